#include "sources/v4l2/system_calls.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

namespace maq {

int SystemCalls::open(const char* path, int flags) { return ::open(path, flags); }
int SystemCalls::close(int fd) { return ::close(fd); }
int SystemCalls::ioctl(int fd, unsigned long request, void* argument) { return ::ioctl(fd, request, argument); }
void* SystemCalls::mmap(size_t length, int fd, off_t offset) {
  return ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
}
int SystemCalls::munmap(void* address, size_t length) { return ::munmap(address, length); }
int SystemCalls::poll(pollfd* fds, nfds_t count, int timeout_ms) { return ::poll(fds, count, timeout_ms); }

bool SystemCalls::is_other_thing(const char* path) {
  constexpr unsigned kVideoMajor = 81;  // linux/Documentation/admin-guide/devices.txt
  struct stat found {};
  return ::stat(path, &found) == 0 && (!S_ISCHR(found.st_mode) || major(found.st_rdev) != kVideoMajor);
}

SystemCalls& SystemCalls::real() {
  static SystemCalls calls;
  return calls;
}

}  // namespace maq
