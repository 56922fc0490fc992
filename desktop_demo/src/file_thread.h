// Reads and writes files on a thread of its own, one after the other, so that the window does not wait for the disk.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

class FileThread {
 public:
  using Job = std::function<std::string()>;  // does it, and says what it did

  FileThread() : thread_([this] { run(); }) {}
  ~FileThread() {
    add(nullptr);
    thread_.join();
  }

  void add(Job job) {
    std::lock_guard<std::mutex> lock(mutex_);
    jobs_.push_back(std::move(job));
    wake_.notify_one();
  }
  // So many jobs wait that what can be left out should be.
  bool is_busy() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return jobs_.size() >= 30;
  }
  // What was done last, "" before anything was; or why not.
  std::string told() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return told_;
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
      std::string told;
      try {
        told = job();
      } catch (const std::exception& error) {
        told = error.what();
      }
      lock.lock();
      if (!told.empty()) told_ = told;
    }
  }

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  std::string told_;
  std::thread thread_;
};
