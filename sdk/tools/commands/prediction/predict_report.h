// `maquette predict`: its result, as a table or as JSON.
#pragma once

#include <maquette/maquette.h>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

// One predicted frame, and the errors of each method with --compare.
struct PredictionRow {
  double ahead_s = 0;
  maq_predictor_method method = MAQ_PREDICTOR_LAST;  // as in maq_predictor_stats
  double motion_fraction = 0, predict_ms = 0;
  std::optional<double> last_db, motion_db, chosen_db;
  std::vector<double> samples_db;
  double entropy_bits = 0;  // mean of a code of the samples
};

struct PredictionReport {
  std::string source;
  uint64_t last_seen_frame = 0;
  maq_predictor_method method = MAQ_PREDICTOR_AUTO;
  bool has_errors = false, has_samples = false;
  std::vector<PredictionRow> rows;
  std::string written;  // clip or folder; "": none
};

const char* name_of(maq_predictor_method method);

void print_report(const PredictionReport& report, bool as_json);
