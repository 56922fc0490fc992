// File descriptors with one owner, who closes them.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

#include "core/error.h"

namespace maq {

class UniqueFd {
 public:
  UniqueFd() = default;
  // Takes a file descriptor, as open() returns it: -1 for none.
  explicit UniqueFd(int fd) : fd_(fd) {}
  UniqueFd(UniqueFd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  UniqueFd& operator=(UniqueFd&& other) noexcept {
    if (this != &other) reset(std::exchange(other.fd_, -1));
    return *this;
  }
  ~UniqueFd() { reset(); }

  bool is_open() const { return fd_ >= 0; }
  int get() const { return fd_; }

  // Closes the descriptor, and takes another. A failed close() is not reported: call fsync() where data must be safe.
  void reset(int fd = -1) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = fd;
  }

 private:
  int fd_ = -1;
};

// An event that poll() can wait for (eventfd), from any thread to any thread.
class EventFd {
 public:
  enum class Kind {
    kFlag,     // one take() takes all signals
    kCounting  // each signal is taken by a take() of its own
  };

  // Throws MAQ_ERROR_OUT_OF_MEMORY when the process has no descriptor left.
  explicit EventFd(Kind kind = Kind::kFlag)
      : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | (kind == Kind::kCounting ? EFD_SEMAPHORE : 0))) {
    if (!fd_.is_open()) {
      throw Error(MAQ_ERROR_OUT_OF_MEMORY, "No event can be made to wait for frames (", std::strerror(errno),
                  "); close files or sources that are not needed.");
    }
  }

  // Readable from signal() to take().
  int get() const { return fd_.get(); }

  void signal() noexcept {
    const uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(fd_.get(), &one, sizeof one);
  }

  // False when there was no signal.
  bool take() noexcept {
    uint64_t count = 0;
    return ::read(fd_.get(), &count, sizeof count) == sizeof count;
  }

 private:
  UniqueFd fd_;
};

}  // namespace maq
