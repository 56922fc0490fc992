// Threads of sources that end a little later than their source, as where a device hangs. LeakSanitizer, which looks at
// all threads when the program ends, does not survive one that ends meanwhile.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "support/wait_until.h"

class SourceThreads : public ::testing::Environment {
 public:
  void TearDown() override {
    EXPECT_TRUE(wait_until([] { return !any(); })) << "a source's thread goes on a minute after the last test";
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // its last steps, which have no name any more
  }

  static bool any() {
    std::error_code error;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
      std::string name;
      std::getline(std::ifstream(task.path() / "comm"), name);
      if (name == "maq source") return true;
    }
    return false;
  }
};

inline ::testing::Environment* const source_threads = ::testing::AddGlobalTestEnvironment(new SourceThreads);
