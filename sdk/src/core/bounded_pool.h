// A pool of at most `capacity` objects that are made when first needed and reused afterwards, so that memory stays
// bounded and steady. An acquired object keeps the pool's memory alive, and may be returned from any thread.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace maq {

// The part common to pools of all types, compiled once instead of for each type.
class PooledObjects {
 public:
  using Destroy = void (*)(void* object);

  PooledObjects(size_t capacity, std::string what, Destroy destroy);
  ~PooledObjects();
  PooledObjects(const PooledObjects&) = delete;
  PooledObjects& operator=(const PooledObjects&) = delete;

  size_t capacity() const { return capacity_; }
  // An idle object; nullptr where the caller may make another, or must forget() that. Throws MAQ_ERROR_POOL_EMPTY.
  void* take();
  void forget() noexcept;
  void give_back(void* object) noexcept;

 private:
  const size_t capacity_;
  const std::string what_;
  const Destroy destroy_;
  std::mutex mutex_;
  std::vector<void*> idle_;
  size_t made_ = 0;
};

template <class T>
class BoundedPool {
  static void destroy(void* object) { delete static_cast<T*>(object); }

 public:
  // Returns an object to its pool; one that has no pool is deleted.
  class Deleter {
   public:
    Deleter() = default;
    void operator()(T* object) const {
      if (objects_ == nullptr) return destroy(object);
      objects_->give_back(object);
    }

   private:
    friend BoundedPool;
    explicit Deleter(std::shared_ptr<PooledObjects> objects) : objects_(std::move(objects)) {}
    std::shared_ptr<PooledObjects> objects_;
  };
  using Pooled = std::unique_ptr<T, Deleter>;

  // `what` names the pooled objects in the error text: "frames".
  BoundedPool(size_t capacity, std::string what)
      : objects_(std::make_shared<PooledObjects>(capacity, std::move(what), destroy)) {}

  size_t capacity() const { return objects_->capacity(); }

  // Throws MAQ_ERROR_POOL_EMPTY when every object is held. The object comes as its last user left it.
  Pooled acquire() const {
    auto* object = static_cast<T*>(objects_->take());
    if (object == nullptr) {
      try {
        object = new T();
      } catch (...) {
        objects_->forget();
        throw;
      }
    }
    return Pooled(object, Deleter(objects_));
  }

 private:
  std::shared_ptr<PooledObjects> objects_;
};

}  // namespace maq
