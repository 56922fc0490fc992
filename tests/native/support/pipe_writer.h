// Writes to a named pipe, as another program does.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <future>
#include <string>
#include <thread>

// Opens the pipe, which waits for its reader, and is over when it is destroyed. With a pause it writes byte by byte.
class PipeWriter {
 public:
  PipeWriter(const std::string& path, std::string text, useconds_t pause_us = 0)
      : thread_([this, path, text = std::move(text), pause_us] {
          runs_.set_value();
          const int pipe = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
          const size_t block = pause_us > 0 ? 1 : text.size();
          for (size_t at = 0; at < text.size();) {
            if (pause_us > 0) usleep(pause_us);
            const ssize_t count = ::write(pipe, text.data() + at, std::min(block, text.size() - at));
            EXPECT_GT(count, 0);
            if (count <= 0) break;
            at += size_t(count);
          }
          ::close(pipe);
        }) {
    runs_.get_future().wait();  // a busy machine may start a thread later than a reader waits
  }
  ~PipeWriter() { thread_.join(); }

 private:
  std::promise<void> runs_;
  std::thread thread_;
};
