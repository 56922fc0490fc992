#include "core/bounded_pool.h"

#include "core/error.h"

namespace maq {

PooledObjects::PooledObjects(size_t capacity, std::string what, Destroy destroy)
    : capacity_(capacity), what_(std::move(what)), destroy_(destroy) {
  idle_.reserve(capacity_);  // for every object, so that returning one never allocates
}

PooledObjects::~PooledObjects() {
  for (void* const object : idle_) destroy_(object);
}

void* PooledObjects::take() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!idle_.empty()) {
    void* const object = idle_.back();
    idle_.pop_back();
    return object;
  }
  if (made_ == capacity_) {
    throw Error(MAQ_ERROR_POOL_EMPTY, "All ", capacity_, " ", what_,
                " of the pool are held; release one, or ask for a larger pool_size.");
  }
  ++made_;
  return nullptr;
}

void PooledObjects::forget() noexcept {
  std::lock_guard<std::mutex> lock(mutex_);
  --made_;
}

void PooledObjects::give_back(void* object) noexcept {
  std::lock_guard<std::mutex> lock(mutex_);
  idle_.push_back(object);
}

}  // namespace maq
