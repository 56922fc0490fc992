// How many threads networks run on where the app leaves that to a measurement (MAQ_THREADS_MEASURED).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nn/session.h"

namespace maq {

// The fewest threads whose time is within 5 % of the shortest: more would cost energy for nothing. `median_ms[i]` is
// the time on i + 1 threads, infinite or NaN where they failed. 1 where all did, or there is none.
int choose_threads(const std::vector<double>& median_ms);

// Runs the measured work once.
using TimedRun = std::function<void()>;

// Measures 1 to `max_threads` threads and chooses. `open` makes what is to run on so many, which is gone afterwards.
// After a run of each that does not count, they run in turn, so that a busy moment or a clock that rises meets all of
// them: nine times each, or as often as fits into half a second, but once at least. Of one thread nothing is opened.
// Throws the exception of one thread; numbers that throw are not chosen.
int measure_threads(int max_threads, const std::function<TimedRun(int threads)>& open);

// A network and the input of one size that it is measured with; SizedSessions has the meanings of the first five.
struct TimedNetwork {
  const std::vector<uint8_t>& bytes;
  GraphSpec spec;
  std::string name;
  int width_px, height_px;
  Shape input;
  std::vector<Shape> outputs;
};

// measure_threads() of up to default_threads() for the network on zeros: layers take the same time whatever the values.
// `settings.threads` is not read. Throws the errors of Session.
int measure_threads(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const TimedNetwork& network,
                    SessionSettings settings);

}  // namespace maq
