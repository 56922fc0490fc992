// `maquette predict --samples`: what may come, drawn several times over.
#pragma once

#include <cstdint>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

struct SampleOptions {
  int samples = 0;  // 0: none are asked for
  double temperature = 1;
  uint32_t top_k = 0;
  uint64_t seed = 0;
  uint32_t passes = 0;
  std::string bundle;  // folder; "": the one installed with the library
};

class DrawnSamples {
 public:
  DrawnSamples(const maquette::Context& context, const SampleOptions& options, int threads);

  void push(const maquette::Frame& frame) { predictor_.push(frame); }
  // `frames` of each sample, `step_s` apart, after those that were pushed. Longer steps than networks know are drawn in
  // several.
  void draw(int64_t frames, double step_s);

  int count() const { return options_.samples; }
  // Frame `number`, from 1, of a sample, from 0.
  maquette::Frame frame(int sample, int64_t number) { return predictor_.drawn(uint32_t(sample), steps(number)); }
  // Bits of a code by cell, mean of the samples.
  std::vector<float> uncertainty(int64_t number) const;

 private:
  uint32_t steps(int64_t number) const { return uint32_t(number * steps_a_frame_); }

  const SampleOptions options_;
  maquette::Predictor predictor_;
  int64_t steps_a_frame_ = 1;
};

// The picture with its uncertain cells in red. BGR.
cv::Mat draw_uncertainty(const std::vector<float>& bits, const cv::Mat& picture);
