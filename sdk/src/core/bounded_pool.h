// A pool of at most `capacity` objects that are made when first needed and reused afterwards, so that memory stays
// bounded and steady. An acquired object keeps the pool's memory alive, and may be returned from any thread.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "core/error.h"

namespace maq {

template <class T>
class BoundedPool {
  struct State {
    std::mutex mutex;
    std::vector<std::unique_ptr<T>> idle;
    size_t made = 0;
  };

 public:
  // Returns an object to its pool; one that has no pool is deleted.
  class Deleter {
   public:
    Deleter() = default;
    void operator()(T* object) const {
      std::unique_ptr<T> owned(object);
      if (state_ == nullptr) return;
      std::lock_guard<std::mutex> lock(state_->mutex);
      state_->idle.push_back(std::move(owned));
    }

   private:
    friend BoundedPool;
    explicit Deleter(std::shared_ptr<State> state) : state_(std::move(state)) {}
    std::shared_ptr<State> state_;
  };
  using Pooled = std::unique_ptr<T, Deleter>;

  // `what` names the pooled thing in the error text: "frames".
  BoundedPool(size_t capacity, std::string what)
      : state_(std::make_shared<State>()), capacity_(capacity), what_(std::move(what)) {
    // Room for every object, so that returning one never allocates.
    state_->idle.reserve(capacity_);
  }

  size_t capacity() const { return capacity_; }

  // Throws MAQ_ERROR_POOL_EMPTY when every object is held. The object comes as its last user left it.
  Pooled acquire() const {
    std::lock_guard<std::mutex> lock(state_->mutex);
    std::unique_ptr<T> object;
    if (!state_->idle.empty()) {
      object = std::move(state_->idle.back());
      state_->idle.pop_back();
    } else if (state_->made == capacity_) {
      throw Error(MAQ_ERROR_POOL_EMPTY, "All ", capacity_, " ", what_,
                  " of the pool are held; release one, or ask for a larger pool_size.");
    } else {
      object = std::make_unique<T>();
      ++state_->made;
    }
    return Pooled(object.release(), Deleter(state_));
  }

 private:
  std::shared_ptr<State> state_;
  size_t capacity_;
  std::string what_;
};

}  // namespace maq
