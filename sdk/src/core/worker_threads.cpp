#include "core/worker_threads.h"

#include <algorithm>

#include "core/clock.h"
#include "core/error.h"
#include "core/thread.h"

namespace maq {

int default_threads() {
  constexpr int kMaxDefault = 4;
  const std::vector<int> cores = allowed_cores();
  const int large = cores.empty() ? int(std::thread::hardware_concurrency()) : count_large_cores(cores);
  return std::clamp(large, 1, kMaxDefault);
}

WorkerThreads::WorkerThreads(int count, std::chrono::microseconds patience) : patience_(patience) {
  if (count < 1 || count > kMaxThreads) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Threads are ", count, ", but must be 1 to ", kMaxThreads, ".");
  }
  threads_.reserve(size_t(count - 1));
  try {
    while (this->count() < count) {
      threads_.push_back(start_thread("maq worker", [this, worker = this->count()] { stay(worker); }));
    }
  } catch (const Error&) {
    // The threads that started do the work.
  } catch (...) {
    stop();
    throw;
  }
}

WorkerThreads::~WorkerThreads() { stop(); }

void WorkerThreads::stop() {
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stops_ = true;
  }
  begins_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkerThreads::run_with(size_t tasks, Call call, void* work) {
  if (tasks == 0) return;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    tasks_ = tasks;
    call_ = call;
    work_ = work;
    failure_ = nullptr;
    next_ = 0;
    ++round_;
    is_open_ = tasks > 1;
  }
  if (tasks > 1) begins_.notify_all();
  take_tasks(0);
  std::unique_lock<std::mutex> lock(mutex_);
  // A thread that has not woken up by now is not waited for.
  is_open_ = false;
  if (working_ != 0) {
    lock.unlock();
    look_out([this] { return working_ == 0; });
    lock.lock();
    ends_.wait(lock, [this] { return working_ == 0; });
  }
  if (failure_ != nullptr) std::rethrow_exception(failure_);
}

void WorkerThreads::take_tasks(int worker) {
  try {
    for (size_t task = next_++; task < tasks_; task = next_++) call_(work_, task, worker);
  } catch (...) {
    next_ = tasks_;
    std::lock_guard<std::mutex> lock(mutex_);
    if (failure_ == nullptr) failure_ = std::current_exception();
  }
}

template <class Condition>
void WorkerThreads::look_out(Condition&& is_there) const {
  if (patience_.count() == 0) return;
  const auto end = MonotonicClock::now() + patience_;
  do {
    for (int i = 0; i < 200; ++i) {
      if (is_there()) return;
    }
  } while (MonotonicClock::now() < end);
}

void WorkerThreads::stay(int worker) {
  unsigned seen = 0;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    const auto is_called = [&] { return stops_ || (is_open_ && round_ != seen); };
    if (!is_called()) {
      lock.unlock();
      look_out(is_called);
      lock.lock();
    }
    begins_.wait(lock, is_called);
    if (stops_) return;
    seen = round_;
    ++working_;
    lock.unlock();
    take_tasks(worker);
    lock.lock();
    if (--working_ == 0) ends_.notify_one();
  }
}

}  // namespace maq
