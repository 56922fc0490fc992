// Measures the notifications of an app with a window about a live source (benchmarks/ui_latency.py).
//
//   measure_live_source DENSEPOSE_BUNDLE URI SECONDS
//
// plays the source twice with one LiveDensePose; its model loads the first time. Prints a JSON list of both: events, in
// ms since open() was called (the state of the notification, or "result" for the first result after a state), and the
// longest call of the window's thread, which asks for the status every 5 ms.
#include <app/live_densepose.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kResult = "result";
constexpr const char* kStates[] = {"stopped", "opening",      "loading", "running", "paused",
                                   "stalled", "reconnecting", "ended",   "failed"};

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

class Events {
 public:
  void begin() {
    const std::lock_guard<std::mutex> lock(mutex_);
    start_ = Clock::now();
    events_.clear();
  }
  void add_result() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (events_.empty() || events_.back().name != kResult) events_.push_back({kResult, ms_since(start_)});
  }
  void add_state(maq_pipeline_state state) {
    const std::lock_guard<std::mutex> lock(mutex_);
    events_.push_back({kStates[state], ms_since(start_)});
  }
  void print(double longest_call_ms) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const char* separator = "";
    std::printf("{\"longest_call_ms\": %.3f, \"events\": [", longest_call_ms);
    for (const Event& event : events_) {
      std::printf("%s{\"name\": \"%s\", \"ms\": %.3f}", separator, event.name.c_str(), event.ms);
      separator = ", ";
    }
    std::printf("]}");
  }

 private:
  struct Event {
    std::string name;
    double ms;
  };
  mutable std::mutex mutex_;
  Clock::time_point start_;
  std::vector<Event> events_;
};

// Returns the longest call in ms.
double play(maquette::LiveDensePose& live, const std::string& uri, double seconds) {
  const Clock::time_point start = Clock::now();
  live.open(uri);
  double longest_ms = ms_since(start);
  while (ms_since(start) < seconds * 1000) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const Clock::time_point before = Clock::now();
    const bool has_failed = live.status().has_failed;
    longest_ms = std::max(longest_ms, ms_since(before));
    if (has_failed) throw std::runtime_error(live.status().problem);
  }
  return longest_ms;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 4) throw std::runtime_error("arguments: DENSEPOSE_BUNDLE URI SECONDS");
  const maquette::Context context;
  maq_densepose_config config = maquette::default_densepose_config();
  config.model.bundle_path = argv[1];
  Events events;
  maquette::LiveDensePose* told = nullptr;  // the pipeline starts when it is opened
  maquette::LiveDensePose live(
      context, config, [&](const maquette::PipelineResult&, double) { events.add_result(); },
      [&] { events.add_state(told->status().states.back()); });
  told = &live;
  for (const char* separator : {"[", ",\n "}) {
    events.begin();
    const double longest_call_ms = play(live, argv[2], std::atof(argv[3]));
    std::printf("%s", separator);
    events.print(longest_call_ms);
  }
  std::puts("]");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "measure_live_source: %s\n", error.what());
  return 1;
}
