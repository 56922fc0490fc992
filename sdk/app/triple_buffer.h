// Hands values from one thread to another: the newest wins, neither thread waits, nothing is copied.
#pragma once

#include <mutex>
#include <utility>

namespace maquette {

template <class T>
class TripleBuffer {
 public:
  // For the writing thread: the value that it fills next. It holds an older value, whose memory can be reused.
  T& back() { return back_; }
  // For the writing thread: back() is the newest value from now on.
  void publish() {
    std::lock_guard<std::mutex> lock(mutex_);
    std::swap(back_, middle_);
    is_fresh_ = true;
  }

  // For the reading thread: true when front() has become a newer value.
  bool take() {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!is_fresh_) return false;
    std::swap(front_, middle_);
    is_fresh_ = false;
    return true;
  }
  const T& front() const { return front_; }

 private:
  std::mutex mutex_;
  T back_{}, middle_{}, front_{};
  bool is_fresh_ = false;
};

}  // namespace maquette
