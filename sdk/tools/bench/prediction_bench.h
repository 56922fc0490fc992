// `maquette bench --predict`: times of novelty and predicted frames.
#pragma once

#include <string>

struct PredictionBenchOptions {
  std::string source = "stub:people?count=2";  // or another argument of parse_source_argument
  std::string bundle;                          // folder; "": the default one
  std::string json;                            // file; "": none
  int threads = 0;
  int warm_up = 10, runs = 20;  // of each case; a run is a frame, or all frames of one sampling
  double seconds = 3;           // of each case, at least
};

// Returns the exit code.
int run_prediction_bench(const PredictionBenchOptions& options);
