// A pool of threads that share the tasks of one piece of work after another. They stay, because starting a thread takes
// longer than many of the tasks.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace maq {

// The limit for a network or a piece of work; more is refused.
inline constexpr int kMaxThreads = 64;

// The numbers of the cores that this thread may run on, as of now; empty where the system does not tell.
std::vector<int> allowed_cores();

// Returns the number of large cores among `allowed`. Phones and boards combine a few large cores with several small
// ones, which are some three times slower: the large cores would wait for them. Cores are compared by the capacity that
// the system reports, or else by their highest frequency. Returns all cores if one of them has neither. `folder`
// contains cpu0, cpu1, ….
int count_large_cores(const std::vector<int>& allowed, const std::string& folder = "/sys/devices/system/cpu");

// The default: as many as there are large cores, but at most 4. More do not pay for networks of this size.
int default_threads();

class WorkerThreads {
 public:
  // `count` includes the thread that calls run(), so that of 1 none is started. Where the system has no more threads,
  // count() is less. A thread looks out for the next work for `patience` before it sleeps: waking one up costs as much
  // as some small tasks. Throws MAQ_ERROR_INVALID_ARGUMENT unless it is 1 to kMaxThreads.
  explicit WorkerThreads(int count, std::chrono::microseconds patience = {});
  ~WorkerThreads();
  WorkerThreads(const WorkerThreads&) = delete;
  WorkerThreads& operator=(const WorkerThreads&) = delete;

  int count() const { return int(threads_.size()) + 1; }

  // Calls work(task, worker) once for each task below `tasks`, in no order, with worker below count() and never twice
  // at once for the same worker. Returns when all are done; throws the exception of one of them, after which the rest
  // is skipped. Not for two threads at once.
  template <class Work>
  void run(size_t tasks, Work&& work) {
    run_with(
        tasks, [](void* of, size_t task, int worker) { (*static_cast<Work*>(of))(task, worker); }, &work);
  }

 private:
  using Call = void (*)(void* work, size_t task, int worker);
  void run_with(size_t tasks, Call call, void* work);
  void take_tasks(int worker);
  void stay(int worker);
  void stop();
  template <class Condition>
  void look_out(Condition&& is_there) const;

  const std::chrono::microseconds patience_;
  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable begins_, ends_;
  // Written under the mutex, or of the round that all agree on.
  std::atomic<unsigned> round_{0};
  std::atomic<int> working_{0};
  std::atomic<bool> is_open_{false}, stops_{false};
  std::exception_ptr failure_;
  size_t tasks_ = 0;
  Call call_ = nullptr;
  void* work_ = nullptr;
  std::atomic<size_t> next_{0};
};

}  // namespace maq
