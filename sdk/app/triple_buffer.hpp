// Hands values from a thread that makes them to one that uses them: the newest wins, nobody waits, nothing is copied.
#ifndef MAQUETTE_NEWEST_HPP_
#define MAQUETTE_NEWEST_HPP_

#include <mutex>
#include <utility>

namespace maquette {

template <class T>
class Newest {
 public:
  // Of the making thread: what it fills next. It holds an older value, whose memory can be used again.
  T& back() { return back_; }
  // Of the making thread: back() is the newest from now on.
  void publish() {
    std::lock_guard<std::mutex> lock(mutex_);
    std::swap(back_, waiting_);
    fresh_ = true;
  }

  // Of the using thread: true when front() has become a newer value.
  bool take() {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!fresh_) return false;
    std::swap(front_, waiting_);
    fresh_ = false;
    return true;
  }
  const T& front() const { return front_; }

 private:
  std::mutex mutex_;
  T back_{}, waiting_{}, front_{};
  bool fresh_ = false;
};

}  // namespace maquette

#endif  // MAQUETTE_NEWEST_HPP_
