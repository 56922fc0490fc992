#include "prediction/refine/refined_predictor.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/clock.h"

namespace maq {
namespace {

constexpr float kNoise = 0.5f;  // grey levels by which int8 alone changes an image

}  // namespace

RefinedPredictor::RefinedPredictor(RefinerNetworks networks, const MotionSettings& motion)
    : networks_(std::move(networks)),
      base_(motion),
      threads_(motion.threads),
      images_(size_t(networks_.encoder->frame_px()) * size_t(networks_.encoder->frame_px()) * 3) {
  const auto side_px = size_t(networks_.encoder->frame_px());
  input_rgb_.resize(side_px * side_px * 3);
  refined_.resize(input_rgb_.size());
}

void RefinedPredictor::forget() {
  images_.clear();
  has_frame_ = false;
}

void RefinedPredictor::reset() {
  base_.reset();
  forget();
  step_ns_ = 0;
}

void RefinedPredictor::push(const Frame& frame) {
  const Stopwatch stage;
  networks_.encoder->resize_to_input(frame.image, input_rgb_.data());
  networks_ms_ = float(stage.elapsed_ms());
  base_.push(frame);
  if (base_.stats().resets != resets_) {
    resets_ = base_.stats().resets;
    forget();
  }
  if (has_frame_ && frame.timestamp_ns == newest_ns_) return;  // it replaces the newest frame; the first image stays
  step_ns_ = has_frame_ ? frame.timestamp_ns - newest_ns_ : 0;
  newest_ns_ = frame.timestamp_ns;
  has_frame_ = true;
  images_.add(input_rgb_.data(), newest_ns_);
}

void RefinedPredictor::predict(int64_t ahead_ns, Frame& frame) {
  base_.predict(ahead_ns, frame);
  networks_ms_ = 0;
  is_refined_ = false;
  if (ahead_ns == 0 || step_ns_ == 0 || !base_.moves()) return;
  const Stopwatch stage;
  networks_.encoder->resize_to_input(frame.image, input_rgb_.data());
  ResidualRefiner& refiner = *networks_.refiner;
  std::array<const uint8_t*, ResidualRefiner::kMaxBefore> before{};
  images_.select(newest_ns_ + step_ns_, refiner.before(), before.data());
  refiner.run(before.data(), input_rgb_.data(), float(double(step_ns_) / 1e9), float(double(ahead_ns) / 1e9),
              refined_.data());
  for (size_t i = 0; i < refined_.size(); ++i) {
    const float difference = refined_[i] - float(input_rgb_[i]);
    refined_[i] = difference - std::clamp(difference, -kNoise, kNoise);
  }
  residual_.add(refined_.data(), networks_.encoder->frame_px(), frame.image, threads_, frame.storage.data());
  is_refined_ = true;
  networks_ms_ = float(stage.elapsed_ms());
}

PredictorStats RefinedPredictor::stats() const {
  PredictorStats stats = base_.stats();
  stats.networks_ms = networks_ms_;
  if (is_refined_) stats.method = PredictionMethod::kRefined;
  return stats;
}

}  // namespace maq
