// `maquette bench --predict`: how long surprise and predicted pictures of a stream take.
#pragma once

#include <string>

struct PredictionBenchOptions {
  std::string source = "stub:people?count=2";  // or what parse_source_argument takes
  std::string bundle;                          // folder; "": the default one
  std::string json;                            // file; "": none
  int threads = 0;
  int warm_up = 10, runs = 20;  // of each case, where a run is a frame or some that are drawn at once
  double seconds = 3;           // of each case, at least
};

// Returns the exit code.
int run_prediction_bench(const PredictionBenchOptions& options);
