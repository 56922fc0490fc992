// The system calls that a camera needs, so that a test can take the kernel's place.
#pragma once

#include <poll.h>
#include <sys/types.h>

#include <cstddef>

namespace maq {

class SystemCalls {
 public:
  virtual ~SystemCalls() = default;

  // Like the calls of these names: -1 (mmap: MAP_FAILED) and errno when they fail. mmap is shared, to read and write.
  virtual int open(const char* path, int flags);
  virtual int close(int fd);
  virtual int ioctl(int fd, unsigned long request, void* argument);
  virtual void* mmap(size_t length, int fd, off_t offset);
  virtual int munmap(void* address, size_t length);
  virtual int poll(pollfd* fds, nfds_t count, int timeout_ms);

  // Whether the path is there, but not as a device of Video4Linux. Opening such a file could change it: it may be a
  // terminal, a disk or a tape.
  virtual bool is_other_thing(const char* path);

  // Returns the calls of the system.
  static SystemCalls& real();
};

}  // namespace maq
