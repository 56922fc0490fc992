// Saves snapshots and clips of the window to a folder, without delaying the thread that draws.
//
//   maquette::Saver saver(context, "/home/me/Pictures");
//   saver.begin_clip(25);
//   for (;;) { draw(); if (saver.takes_clip_images()) saver.add_to_clip(shown_pixels()); write(saver.message()); }
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "app/rgba_image.h"

namespace maquette {

// Reads and writes files on a thread of its own, one after the other, so that drawing does not wait for the disk.
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

class Saver {  // all calls by one thread
 public:
  // The context must outlive this. The destructor completes all jobs.
  Saver(const Context& context, const std::string& folder) : context_(context), folder_(folder) {}
  ~Saver() { end_clip(); }
  Saver(const Saver&) = delete;
  Saver& operator=(const Saver&) = delete;

  // Writes the files that belong to a snapshot, whose paths begin with `path`. Returns the rest of their names for the
  // message.
  using Companions = std::function<std::string(const std::string& path)>;
  // A PNG of the image, and `companions`, which may be null.
  void save_snapshot(RgbaImage image, Companions companions);

  // `fps`: how often images will be added.
  void begin_clip(double fps);
  void end_clip();
  bool has_clip() const { return clip_ != nullptr; }
  // False as well while the disk is slower than the images come.
  bool takes_clip_images() const { return has_clip() && !files_.is_busy(); }
  // A clip has one size, so it ends when an image has another.
  void add_to_clip(RgbaImage image);

  // Returns a path in the folder, named by the time and a count, for files that others write.
  std::string new_path(const char* extension);
  // Another job for the thread that writes, in its turn.
  void run(FileThread::Job job) { files_.add(std::move(job)); }
  // Name of the last saved file, or the reason why it was not saved, for five seconds.
  std::string message();

 private:
  struct OpenClip {
    std::string path;
    int width_px = 0, height_px = 0;  // 0 before the first image
    std::optional<Clip> file;         // of the thread that writes
  };

  const Context& context_;
  const std::string folder_;
  int file_count_ = 0;
  std::string message_;
  std::chrono::steady_clock::time_point message_since_;
  std::shared_ptr<OpenClip> clip_;
  FileThread files_;  // last: its jobs use the others
};

}  // namespace maquette
