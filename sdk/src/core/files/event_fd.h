// An event between threads that the system can wait for together with descriptors.
#pragma once

#include <cstdint>

namespace maq {

// An event that poll() can wait for (eventfd), from any thread to any thread. On Windows get() is the value of a
// HANDLE.
class EventFd {
 public:
  enum class Kind {
    kFlag,     // one take() takes all signals
    kCounting  // each signal is taken by a take() of its own
  };

  // Throws MAQ_ERROR_OUT_OF_MEMORY when the process has no descriptor left.
  explicit EventFd(Kind kind = Kind::kFlag);
  ~EventFd();
  EventFd(const EventFd&) = delete;
  EventFd& operator=(const EventFd&) = delete;

  // Readable from signal() to take().
  int get() const { return fd_; }

  void signal() noexcept;

  // False when there was no signal.
  bool take() noexcept;

 private:
  int fd_;
};

// Waits until the event of that number (EventFd::get) is signalled, which stays so. False after `time_ns`.
bool wait_for_event(int event, int64_t time_ns) noexcept;

}  // namespace maq
