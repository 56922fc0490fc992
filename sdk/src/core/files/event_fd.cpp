#include "core/files/event_fd.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/error.h"

namespace maq {

EventFd::EventFd(Kind kind)
    : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | (kind == Kind::kCounting ? EFD_SEMAPHORE : 0))) {
  if (fd_ < 0) {
    throw Error(MAQ_ERROR_OUT_OF_MEMORY, "No event can be made to wait for frames (", std::strerror(errno),
                "); close files or sources that are not needed.");
  }
}

EventFd::~EventFd() { ::close(fd_); }

void EventFd::signal() noexcept {
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
}

bool EventFd::take() noexcept {
  uint64_t count = 0;
  return ::read(fd_, &count, sizeof count) == sizeof count;
}

bool wait_for_event(int event, int64_t time_ns) noexcept {
  pollfd awaited{event, POLLIN, 0};
  const timespec time{time_t(time_ns / 1000000000), long(time_ns % 1000000000)};
  return ::ppoll(&awaited, 1, &time, nullptr) > 0;
}

}  // namespace maq
