#include "nn/thread_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/clock.h"
#include "core/worker_threads.h"
#include "nn/sized_sessions.h"

namespace maq {
namespace {

constexpr double kWorthwhile = 1.05;  // further threads must save more
constexpr size_t kMaxRounds = 9;
constexpr double kMaxTime_ms = 500;

// One number of threads.
struct Candidate {
  TimedRun run;  // empty after a failure
  std::vector<double> ms;

  double median_ms() const {
    if (!run) return std::numeric_limits<double>::infinity();
    std::vector<double> sorted = ms;
    const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return *middle;
  }
};

// `work` on a candidate; a failure of more than one thread is theirs alone.
template <class Work>
void attempt(Candidate& candidate, int threads, Work&& work) {
  try {
    work();
  } catch (const std::exception&) {
    if (threads == 1) throw;
    candidate.run = nullptr;
  }
}

}  // namespace

int choose_threads(const std::vector<double>& median_ms) {
  double shortest = std::numeric_limits<double>::infinity();
  for (const double ms : median_ms) {
    if (ms < shortest) shortest = ms;  // which no NaN is
  }
  if (std::isinf(shortest)) return 1;
  const auto chosen =
      std::find_if(median_ms.begin(), median_ms.end(), [=](double ms) { return ms <= kWorthwhile * shortest; });
  return int(chosen - median_ms.begin()) + 1;
}

int measure_threads(int max_threads, const std::function<TimedRun(int threads)>& open) {
  if (max_threads <= 1) return 1;
  const Stopwatch total;
  std::vector<Candidate> candidates(static_cast<size_t>(max_threads));
  for (size_t i = 0; i < candidates.size(); ++i) {
    Candidate& candidate = candidates[i];
    const int threads = int(i) + 1;
    attempt(candidate, threads, [&] {
      candidate.run = open(threads);
      candidate.run();
    });
  }
  for (size_t round = 0; round < kMaxRounds && (round == 0 || total.elapsed_ms() < kMaxTime_ms); ++round) {
    for (size_t i = 0; i < candidates.size(); ++i) {
      Candidate& candidate = candidates[i];
      if (!candidate.run) continue;
      attempt(candidate, int(i) + 1, [&] {
        const Stopwatch one;
        candidate.run();
        candidate.ms.push_back(one.elapsed_ms());
      });
    }
  }
  std::vector<double> medians;
  for (const Candidate& candidate : candidates) medians.push_back(candidate.median_ms());
  return choose_threads(medians);
}

int measure_threads(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const TimedNetwork& network,
                    SessionSettings settings) {
  size_t values = 1;
  for (const int64_t extent : network.input) values *= size_t(extent);
  const std::vector<float> zeros(values);
  return measure_threads(default_threads(), [&](int threads) -> TimedRun {
    settings.threads = threads;
    const auto sessions =
        std::make_shared<SizedSessions>(runtime, network.bytes, network.spec, network.name, settings, 1);
    return [&network, &zeros, sessions] {
      sessions->at(network.width_px, network.height_px).run({{zeros.data(), network.input}}, network.outputs);
    };
  });
}

}  // namespace maq
