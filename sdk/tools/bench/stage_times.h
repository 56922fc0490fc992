// Times of a case of `maquette bench`: the times of its stages, run by run, and the reasons why they may be unreliable.
#pragma once

#include <chrono>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

double ms_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to);

class StageTimes {
 public:
  // `stages` in their order; the last one is all of a run.
  explicit StageTimes(std::vector<const char*> stages) : stages_(std::move(stages)), ms_(stages_.size()) {}

  // Adds a run: a time for each stage, and the CPU time of all threads.
  void add(const std::vector<double>& ms, double processor_s);

  const std::vector<const char*>& stages() const { return stages_; }
  size_t runs() const { return ms_[0].size(); }
  double seconds() const { return seconds_; }
  double percentile_ms(size_t stage, double percent) const;
  double median_ms() const { return percentile_ms(stages_.size() - 1, 50); }
  double runs_per_second() const;
  double processor_ms() const;  // of a run

  // Reasons why the times are unreliable, for the requested numbers of runs and seconds; empty if they are reliable.
  std::vector<std::string> warnings(int min_runs, double min_seconds) const;
  nlohmann::ordered_json ms_json() const;  // p50, p90 and p99 of each stage
  double cores_busy() const;

 private:
  std::vector<const char*> stages_;
  std::vector<std::vector<double>> ms_;
  double seconds_ = 0, processor_s_ = 0;
};

// CPU time that other processes took since this object was created.
class OtherProcesses {
 public:
  OtherProcesses();

  double cpu_fraction() const;  // of all cores
  // Why times of a measurement that took so much beside it are unreliable; empty if they are not.
  static std::vector<std::string> warnings(double cpu_fraction);

 private:
  double before_s_;
  std::chrono::steady_clock::time_point from_;
};
