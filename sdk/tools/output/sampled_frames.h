// `maquette predict --samples`: several possible futures of one stream.
#pragma once

#include <cstdint>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "output/canvas.h"

struct SampleOptions {
  int samples = 0;  // 0: none
  double temperature = 1;
  uint64_t seed = 0;

  void apply(maq_predictor_config* config) const {
    config->temperature = float(temperature);
    config->seed = seed;
  }
};

class SampledFrames {
 public:
  // `bundle`: a folder; "": the bundle installed with the library.
  SampledFrames(const maquette::Context& context, const SampleOptions& options, const std::string& bundle, int threads);

  void push(const maquette::Frame& frame) { predictor_.push(frame); }
  // Samples `frames` frames, `step_s` apart. Steps that are longer than the networks know are split.
  void sample(int64_t frames, double step_s);

  int count() const { return options_.samples; }
  // Decodes frame `number` (1-based) of sample `sample` (0-based).
  maquette::Frame frame(int sample, int64_t number) {
    return predictor_.acquire_sample(uint32_t(sample), steps(number));
  }
  // Returns the entropy map of frame `number`, the mean of all samples.
  std::vector<float> entropy_map(int64_t number) const;

 private:
  uint32_t steps(int64_t number) const { return uint32_t(number * steps_a_frame_); }

  const SampleOptions options_;
  maquette::Predictor predictor_;
  int64_t steps_a_frame_ = 1;
};

// Returns the image with uncertain cells in red.
Canvas draw_entropy_map(const std::vector<float>& bits, const Canvas& image);

// Mixes red into the image: `cells` are from 0 to 1.
void redden(const FloatPlane& cells, Canvas& image);
