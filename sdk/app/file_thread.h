// Reads and writes files on a thread of its own, one after the other, so that drawing does not wait for the disk.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace maquette {

class FileThread {
 public:
  using Job = std::function<std::string()>;  // returns a message for the user; "": none

  FileThread() : thread_([this] { run(); }) {}
  ~FileThread() {  // after all that was added
    add(nullptr);
    thread_.join();
  }

  void add(Job job) {
    std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
    wake_.notify_one();
  }
  // Many jobs wait: leave out optional jobs.
  bool is_busy() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return jobs_.size() >= 30;
  }
  // Message of the latest job that had one, or the reason why it failed.
  std::string message() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return message_;
  }

 private:
  void run() {
    for (;;) {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [&] { return !jobs_.empty(); });
      const Job job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      if (!job) return;
      std::string message;
      try {
        message = job();
      } catch (const std::exception& error) {
        message = error.what();
      }
      lock.lock();
      if (!message.empty()) message_ = message;
    }
  }

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  std::string message_;
  std::thread thread_;
};

}  // namespace maquette
