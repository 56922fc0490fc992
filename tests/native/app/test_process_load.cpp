#include <gtest/gtest.h>

#include <app/process_load.h>

#include <thread>
#include <vector>

namespace {

TEST(ProcessLoad, ABusyThreadAndItsMemoryAreSeen) {
  maquette::ProcessLoad load;
  EXPECT_EQ(load.memory_mb(), 0) << "not measured yet";
  const std::vector<char> memory(size_t(50) << 20, 1);
  volatile size_t count = 0;
  while (load.memory_mb() == 0) {
    for (size_t i = 0; i < memory.size(); i += 4096) count = count + size_t(memory[i]);
    load.update();
  }
  EXPECT_GT(load.memory_mb(), 50);
  EXPECT_GT(load.cpu_percent(), 1);
}

}  // namespace
