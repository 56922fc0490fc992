// `maquette predict --surprise`.
#pragma once

#include <cstdint>
#include <string>

struct SurpriseOptions {
  std::string source;
  std::string bundle;
  std::string out;
  double event_ratio = 4;
  int64_t max_frames = 0;  // 0: to the end of the source
  int threads = 0;
  bool json = false;
};

// Prints what stands out in a stream: a meter in a terminal, a line an event, or a JSON line a frame; draws a clip
// where one is asked for. Returns the exit
// code.
int run_surprise(const SurpriseOptions& options);
