#include "output/sampled_frames.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace {

constexpr double kMaxStep_s = 0.125;
constexpr int64_t kMaxSteps = 64;   // of maq_predictor_sample
constexpr float kFullRed_bits = 5;  // most cells are below

maquette::Predictor make_sampler(const maquette::Context& context, const SampleOptions& options,
                                 const std::string& bundle, int threads) {
  maq_predictor_config config = maquette::default_predictor_config();
  if (!bundle.empty()) config.model.bundle_path = bundle.c_str();
  config.model.threads = threads;
  config.method = MAQ_PREDICTOR_SAMPLED;
  options.apply(&config);
  return maquette::Predictor(context, config);
}

}  // namespace

SampledFrames::SampledFrames(const maquette::Context& context, const SampleOptions& options, const std::string& bundle,
                             int threads)
    : options_(options), predictor_(make_sampler(context, options, bundle, threads)) {}

void SampledFrames::sample(int64_t frames, double step_s) {
  steps_a_frame_ = std::max(int64_t(1), int64_t(std::ceil(step_s / kMaxStep_s - 1e-6)));
  if (frames * steps_a_frame_ > kMaxSteps) {
    throw std::runtime_error("Samples have at most " + std::to_string(kMaxSteps) + " steps of 0.125 s; give --frames " +
                             std::to_string(kMaxSteps / steps_a_frame_) + " or less.");
  }
  predictor_.sample(uint32_t(options_.samples), steps(frames), step_s / double(steps_a_frame_));
}

std::vector<float> SampledFrames::entropy_map(int64_t number) const {
  std::vector<float> mean;
  for (int sample = 0; sample < count(); ++sample) {
    const std::vector<float> own = predictor_.entropy_map(uint32_t(sample), steps(number));
    mean.resize(own.size());
    for (size_t i = 0; i < own.size(); ++i) mean[i] += own[i] / float(count());
  }
  return mean;
}

Canvas draw_entropy_map(const std::vector<float>& bits, const Canvas& image) {
  const int side = int(std::lround(std::sqrt(double(bits.size()))));
  FloatPlane cells({side, side});
  std::transform(bits.begin(), bits.end(), cells.values.begin(),
                 [](float own) { return 0.8f * std::min(own / kFullRed_bits, 1.0f); });
  Canvas drawn = image;
  redden(cells, drawn);
  return drawn;
}

void redden(const FloatPlane& cells, Canvas& image) {
  const FloatPlane redness = cells.resized(image.size());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) image.mix(x, y, {0, 0, 255}, redness.at(x, y));
  }
}
