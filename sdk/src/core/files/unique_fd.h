// File descriptors with one owner, who closes them.
#pragma once

#include <unistd.h>

#include <utility>

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

}  // namespace maq
