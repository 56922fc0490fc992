#include "commands/prediction/predict_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "output/output_file.h"
#include "print.h"

namespace {

using PredictionJson = nlohmann::ordered_json;

std::string text_of_method(const PredictionRow& row) {
  const std::string name = name_of(row.method);
  if (row.method == MAQ_PREDICTOR_LAST || row.method == MAQ_PREDICTOR_MOTION) return name;
  char share[32];
  std::snprintf(share, sizeof share, "%.0f %% motion", 100 * row.motion_fraction);
  return row.method == MAQ_PREDICTOR_AUTO ? share : name + ", " + share;
}

PredictionJson json_of(const PredictionRow& row, bool has_samples) {
  PredictionJson frame = {{"ahead_s", row.ahead_s},
                          {"method", name_of(row.method)},
                          {"motion_fraction", std::round(1e3 * row.motion_fraction) / 1e3},
                          {"predict_ms", rounded_ms(row.predict_ms)}};
  if (row.last_db) {
    frame["psnr_db"] = {{"last", *row.last_db}, {"motion", *row.motion_db}, {"chosen", *row.chosen_db}};
    if (has_samples) frame["psnr_db"]["samples"] = row.samples_db;
  }
  if (has_samples) frame["entropy_bits"] = row.entropy_bits;
  return frame;
}

void print_row(const PredictionRow& row) {
  if (!row.last_db) {
    print_output("%6.0f ms   no frame to compare with\n", 1e3 * row.ahead_s);
    return;
  }
  print_output("%6.0f ms  %7.2f dB  %7.2f dB  %7.2f dB  %s\n", 1e3 * row.ahead_s, *row.last_db, *row.motion_db,
               *row.chosen_db, text_of_method(row).c_str());
  if (row.samples_db.empty()) return;
  const auto [worst, best] = std::minmax_element(row.samples_db.begin(), row.samples_db.end());
  print_output("           samples %.2f to %.2f dB, %.2f bits a code\n", *worst, *best, row.entropy_bits);
}

}  // namespace

const char* name_of(maq_predictor_method method) {
  switch (method) {
    case MAQ_PREDICTOR_LAST: return "last";
    case MAQ_PREDICTOR_MOTION: return "motion";
    case MAQ_PREDICTOR_SAMPLED: return "sampled";
    default: return "auto";
  }
}

void print_report(const PredictionReport& report, bool as_json) {
  if (as_json) {
    PredictionJson document = {{"source", report.source},
                               {"last_seen_frame", report.last_seen_frame},
                               {"method", name_of(report.method)},
                               {"frames", PredictionJson::array()}};
    for (const PredictionRow& row : report.rows) document["frames"].push_back(json_of(row, report.has_samples));
    if (!report.written.empty()) document["out"] = report.written;
    print_output("%s\n", json_text(document, 1).c_str());
    return;
  }
  if (report.has_errors) {
    print_output("  ahead        last      motion    %s\n", name_of(report.method));
    for (const PredictionRow& row : report.rows) print_row(row);
  }
  if (report.written.empty()) return;
  print_output("%s  %zu predicted frames -> %s\n", report.source.c_str(), report.rows.size(), report.written.c_str());
}
