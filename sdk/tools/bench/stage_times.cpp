#include "bench/stage_times.h"

#include <algorithm>
#include <cstdio>
#include <thread>

#include "machine.h"
#include "output/output_file.h"

namespace {

constexpr double kMaxOthers = 0.05;  // of all cores: more, and the figures are of other processes too
constexpr double kMaxSpread = 1.5;   // p90 by p50

}  // namespace

double ms_between(std::chrono::steady_clock::time_point from, std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

void StageTimes::add(const std::vector<double>& ms, double processor_s) {
  for (size_t i = 0; i < ms_.size(); ++i) ms_[i].push_back(ms.at(i));
  seconds_ += ms.back() / 1e3;
  processor_s_ += processor_s;
}

double StageTimes::percentile_ms(size_t stage, double percent) const {
  std::vector<double> sorted = ms_[stage];
  if (sorted.empty()) return 0;
  std::sort(sorted.begin(), sorted.end());
  const double at = percent / 100 * double(sorted.size() - 1);
  const size_t low = size_t(at);
  const size_t high = std::min(low + 1, sorted.size() - 1);
  return sorted[low] + (sorted[high] - sorted[low]) * (at - double(low));
}

double StageTimes::runs_per_second() const { return 1e3 / std::max(1e-6, median_ms()); }

double StageTimes::processor_ms() const { return 1e3 * processor_s_ / double(std::max<size_t>(1, runs())); }

double StageTimes::cores_busy() const { return processor_s_ / std::max(1e-6, seconds_); }

std::vector<std::string> StageTimes::warnings(int min_runs, double min_seconds) const {
  std::vector<std::string> reasons;
  char text[128];
  if (runs() < size_t(min_runs) || seconds_ < min_seconds) {
    std::snprintf(text, sizeof text, "%zu runs in %.1f s, %d and %.1f s asked for", runs(), seconds_, min_runs,
                  min_seconds);
    reasons.emplace_back(text);
  }
  const double spread = percentile_ms(stages_.size() - 1, 90) / std::max(1e-6, median_ms());
  if (spread > kMaxSpread) {
    std::snprintf(text, sizeof text, "p90 is %.2f times p50, %.2f allowed", spread, kMaxSpread);
    reasons.emplace_back(text);
  }
  return reasons;
}

nlohmann::ordered_json StageTimes::ms_json() const {
  nlohmann::ordered_json ms;
  for (size_t i = 0; i < stages_.size(); ++i) {
    for (const int percent : {50, 90, 99}) {
      ms[stages_[i]]["p" + std::to_string(percent)] = rounded_ms(percentile_ms(i, percent));
    }
  }
  return ms;
}

OtherProcesses::OtherProcesses() : before_s_(others_processor_seconds()), from_(std::chrono::steady_clock::now()) {}

double OtherProcesses::cpu_fraction() const {
  const double wall_s = ms_between(from_, std::chrono::steady_clock::now()) / 1e3;
  const double used_s = std::max(0.0, others_processor_seconds() - before_s_);
  return used_s / (std::max(1e-3, wall_s) * std::max(1u, std::thread::hardware_concurrency()));
}

std::vector<std::string> OtherProcesses::warnings(double cpu_fraction) {
  if (cpu_fraction <= kMaxOthers) return {};
  char text[128];
  std::snprintf(text, sizeof text, "other processes used %.0f %% of the CPU", 100 * cpu_fraction);
  return {text};
}
