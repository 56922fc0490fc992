// Which cores are large, by folders like those of Linux: the default number of threads.
#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>

#include "core/worker_threads.h"
#include "support/temp_folder.h"

namespace {

class ProcessorCores : public ::testing::Test {
 protected:
  void write(int core, const std::string& file, const std::string& text) {
    const std::filesystem::path path = folder_.file("cpu" + std::to_string(core) + "/" + file);
    std::filesystem::create_directories(path.parent_path());
    write_text(path.string(), text);
  }
  void write_capacities(const std::vector<int>& values) {
    for (size_t i = 0; i < values.size(); ++i) write(int(i), "cpu_capacity", std::to_string(values[i]) + "\n");
  }
  void write_frequencies(const std::vector<int>& values) {
    for (size_t i = 0; i < values.size(); ++i) {
      write(int(i), "cpufreq/cpuinfo_max_freq", std::to_string(values[i]) + "\n");
    }
  }
  int count(const std::vector<int>& allowed) const { return maq::count_large_cores(allowed, folder_.path()); }
  static std::vector<int> first(int cores) {
    std::vector<int> all(static_cast<size_t>(cores));
    std::iota(all.begin(), all.end(), 0);
    return all;
  }

  TempFolder folder_;
};

TEST_F(ProcessorCores, OfEqualCoresAllAreLarge) {
  write_capacities({1024, 1024, 1024, 1024});
  EXPECT_EQ(count(first(4)), 4);
}

TEST_F(ProcessorCores, OfFourAndFourTheFasterFourAre) {
  write_capacities({446, 446, 446, 446, 1024, 1024, 1024, 1024});
  EXPECT_EQ(count(first(8)), 4);
}

TEST_F(ProcessorCores, OfOneThreeAndFourTheFirstTwoKindsAre) {
  write_capacities({250, 250, 250, 250, 870, 870, 870, 1024});
  EXPECT_EQ(count(first(8)), 4);
}

TEST_F(ProcessorCores, WithoutCapacitiesFrequenciesTell) {
  write_frequencies({1800000, 1800000, 1800000, 1800000, 2420000, 2420000, 2420000, 2840000});
  EXPECT_EQ(count(first(8)), 4);
}

TEST_F(ProcessorCores, CapacitiesCountMoreThanFrequencies) {
  write_capacities({300, 300, 1024, 1024});
  write_frequencies({2000000, 2000000, 2000000, 2000000});
  EXPECT_EQ(count(first(4)), 2);
}

TEST_F(ProcessorCores, WithoutFilesAllAre) {
  EXPECT_EQ(count(first(6)), 6);
  EXPECT_EQ(maq::count_large_cores(first(6), folder_.file("none")), 6);
  EXPECT_EQ(count({}), 0);
}

TEST_F(ProcessorCores, OneMissingOrDamagedFileMakesTheOthersUseless) {
  for (const char* damaged : {"", "\n", "many", "-5", "0", "\x01\xff"}) {
    write_capacities({446, 446, 1024, 1024});
    write(2, "cpu_capacity", damaged);
    EXPECT_EQ(count(first(4)), 4) << damaged;
  }
  write_frequencies({1800000, 1800000, 2800000, 2800000});
  EXPECT_EQ(count(first(4)), 2) << "frequencies are there still";
  std::filesystem::remove(folder_.file("cpu0/cpufreq/cpuinfo_max_freq"));
  EXPECT_EQ(count(first(4)), 4);
}

TEST_F(ProcessorCores, HugeNumbersAreNumbers) {
  write_capacities({446, 1024});
  write(1, "cpu_capacity", std::string(5000, '9'));
  EXPECT_EQ(count(first(2)), 1);
}

TEST_F(ProcessorCores, CoresThatAreOfflineOrNotAllowedDoNotCount) {
  write_capacities({250, 250, 250, 250, 870, 870, 870, 1024});
  EXPECT_EQ(count({0, 1, 2, 3, 4, 5}), 2) << "6 and 7 are offline";
  EXPECT_EQ(count({0, 1, 2, 7}), 1);
  EXPECT_EQ(count({0, 1, 2, 3}), 4) << "beside small ones alone, small ones are large";
  EXPECT_EQ(count({4}), 1);
  EXPECT_EQ(count({4, 9}), 2) << "nothing is known of core 9";
}

TEST_F(ProcessorCores, TheDefaultIsOneToFourThreadsOnThisMachineToo) {
  EXPECT_FALSE(maq::allowed_cores().empty());
  EXPECT_GE(maq::default_threads(), 1);
  EXPECT_LE(maq::default_threads(), 4);
  EXPECT_LE(maq::default_threads(), int(maq::allowed_cores().size()));
}

}  // namespace
