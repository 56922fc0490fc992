// Threads that share out tasks.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/worker_threads.h"

namespace {

using maq::WorkerThreads;

TEST(WorkerThreads, EachTaskIsDoneOnceRoundAfterRound) {
  for (const int count : {1, 2, 5}) {
    WorkerThreads threads(count);
    EXPECT_EQ(threads.count(), count);
    for (const size_t tasks : {0u, 1u, 2u, 7u, 1000u}) {
      for (int round = 0; round < 20; ++round) {
        std::vector<int> done(tasks, 0);
        std::vector<std::atomic<int>> busy(static_cast<size_t>(count));
        threads.run(tasks, [&](size_t task, int worker) {
          EXPECT_EQ(busy[size_t(worker)]++, 0);
          ++done[task];
          --busy[size_t(worker)];
        });
        for (const int times : done) ASSERT_EQ(times, 1);
      }
    }
  }
}

TEST(WorkerThreads, RunReturnsWhenTheSlowestIsDone) {
  WorkerThreads threads(2);
  for (int round = 0; round < 5; ++round) {
    std::atomic<int> done{0};
    // The other task is done long before.
    threads.run(2, [&](size_t task, int) {
      std::this_thread::sleep_for(std::chrono::milliseconds(int(task) == round % 2 ? 40 : 5));
      ++done;
    });
    ASSERT_EQ(done, 2);
  }
}

TEST(WorkerThreads, WhatATaskThrowsIsThrownAndTheyGoOnAfterwards) {
  for (const int count : {1, 3}) {
    WorkerThreads threads(count);
    for (int round = 0; round < 10; ++round) {
      EXPECT_THROW(threads.run(100,
                               [](size_t task, int) {
                                 if (task == 40) throw std::runtime_error("task 40");
                               }),
                   std::runtime_error);
      std::atomic<int> done{0};
      threads.run(100, [&](size_t, int) { ++done; });
      EXPECT_EQ(done, 100);
    }
  }
}

}  // namespace
