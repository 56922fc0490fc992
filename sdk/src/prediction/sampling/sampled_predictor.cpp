#include "prediction/sampling/sampled_predictor.h"

#include <algorithm>
#include <utility>

#include "core/clock.h"
#include "core/error.h"

namespace maq {

SampledPredictor::SampledPredictor(SamplerNetworks networks, const SamplingSettings& sampling,
                                   const MotionSettings& motion)
    : networks_(std::move(networks)),
      sampling_(sampling),
      base_(motion),
      threads_(motion.threads),
      history_(networks_.encoder->codes().count()),
      motion_(networks_.encoder),
      codes_(networks_.encoder->codes().count()),
      base_codes_(codes_.size()) {
  const auto side_px = size_t(networks_.encoder->frame_px());
  input_rgb_.resize(side_px * side_px * 3);
  image_.resize(input_rgb_.size());
  base_image_.resize(input_rgb_.size());
}

void SampledPredictor::forget() {
  history_.clear();
  motion_.reset();
  has_frame_ = false;
}

void SampledPredictor::reset() {
  base_.reset();
  forget();
  step_ns_ = 0;
  count_ = 0;
}

void SampledPredictor::push(const Frame& frame) {
  count_ = 0;
  const Stopwatch stage;
  networks_.encoder->encode(frame.image, codes_.data(), input_rgb_.data());
  networks_ms_ = float(stage.elapsed_ms());
  base_.push(frame);
  if (base_.stats().resets != resets_) {
    resets_ = base_.stats().resets;
    forget();
  }
  if (has_frame_ && frame.timestamp_ns == newest_ns_) return;  // it replaces the newest frame; the first codes stay
  step_ns_ = has_frame_ ? frame.timestamp_ns - newest_ns_ : 0;
  newest_ns_ = frame.timestamp_ns;
  has_frame_ = true;
  history_.add(codes_.data(), newest_ns_);
  motion_.add(input_rgb_.data(), newest_ns_);
}

size_t SampledPredictor::offset_of(size_t sample_index, size_t frame_index) const {
  if (sample_index >= samples_ || frame_index < 1 || frame_index > count_) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Frame ", frame_index, " of sample ", sample_index, " was asked for, but ",
                count_, " frames (from 1) of ", samples_, " samples (from 0) were sampled since the latest frame.");
  }
  return ((frame_index - 1) * samples_ + sample_index) * codes_.size();
}

void SampledPredictor::sample_frame(size_t frame_index, int64_t step_ns) {
  CodeTransformer& transformer = *networks_.transformer;
  const size_t of_frame = codes_.size(), offset = (frame_index - 1) * samples_ * of_frame;
  uint16_t* const codes = codes_ahead_.data() + offset;
  const int64_t time_ns = newest_ns_ + int64_t(frame_index) * step_ns;
  // The motion of the pushed frames is 1 to 2 dB better here than the motion of a sample's own frames.
  const uint16_t* const moved = transformer.has_motion() ? motion_.at(time_ns, codes_.data()) : nullptr;
  for (size_t s = 0; s < samples_; ++s) {
    const uint16_t* const latest = frame_index == 1 ? codes_.data() : codes - (samples_ - s) * of_frame;
    if (frame_index > 1) histories_[s].add(latest, time_ns - step_ns);
    CodesBefore& before = before_[s];
    before = {};
    before.newest = latest;
    before.step_s = float(double(step_ns) / 1e9);
    // All samples share the context of the first frame.
    histories_[frame_index == 1 ? 0 : s].select(time_ns, transformer.before(), before.frames.data());
    if (transformer.has_motion()) before.frames[transformer.before()] = moved;
  }
  transformer.sample(before_, sampling_, uint32_t(base_.stats().pushed), uint32_t(frame_index), is_cancelled_, codes,
                     entropy_.data() + offset);
}

void SampledPredictor::sample(size_t samples, size_t count, int64_t step_ns) {
  count_ = samples_ = sampled_frames_ = 0;
  networks_ms_ = 0;
  if (is_cancelled_.exchange(false)) throw Error(MAQ_CANCELLED, "Sampling was cancelled.");
  if (!has_frame_) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "No frame was pushed; push the frames of the stream first.");
  }
  const size_t of_frame = codes_.size();
  codes_ahead_.resize(count * samples * of_frame);
  entropy_.assign(codes_ahead_.size(), 0.0f);
  samples_ = samples;
  if (step_ns_ == 0 || !base_.moves()) {
    for (size_t i = 0; i < codes_ahead_.size(); i += of_frame) {
      std::copy(codes_.begin(), codes_.end(), codes_ahead_.begin() + std::ptrdiff_t(i));
    }
  } else {
    const Stopwatch stage;
    histories_.assign(samples, history_);
    before_.assign(samples, {});
    for (size_t k = 1; k <= count; ++k) sample_frame(k, step_ns);
    networks_ms_ = float(stage.elapsed_ms());
    sampled_frames_ = samples * count;
  }
  count_ = count;
  sample_step_ns_ = step_ns;
}

// Adds the difference between the images of `codes` and of the frame's own codes to the frame.
void SampledPredictor::add_residual(const uint16_t* codes, Frame& frame) {
  networks_.decoder->decode(codes, image_.data());
  networks_.encoder->encode(frame.image, base_codes_.data());
  networks_.decoder->decode(base_codes_.data(), base_image_.data());
  for (size_t i = 0; i < image_.size(); ++i) image_[i] -= base_image_[i];
  residual_.add(image_.data(), networks_.encoder->frame_px(), frame.image, threads_, frame.storage.data());
}

void SampledPredictor::decode(size_t sample_index, size_t frame_index, Frame& frame) {
  const size_t offset = offset_of(sample_index, frame_index);
  base_.predict(int64_t(frame_index) * sample_step_ns_, frame);
  is_sampled_ = sampled_frames_ > 0;
  if (is_sampled_) add_residual(codes_ahead_.data() + offset, frame);
}

void SampledPredictor::copy_entropy(size_t sample_index, size_t frame_index, float* bits) const {
  const size_t offset = offset_of(sample_index, frame_index), groups = networks_.encoder->codes().groups;
  for (size_t cell = 0; cell < cells(); ++cell) {
    bits[cell] = 0;
    for (size_t k = 0; k < groups; ++k) bits[cell] += entropy_[offset + cell * groups + k] / float(groups);
  }
}

void SampledPredictor::predict(int64_t ahead_ns, Frame& frame) {
  base_.predict(ahead_ns, frame);
  networks_ms_ = 0;
  count_ = sampled_frames_ = 0;
  is_sampled_ = false;
  if (ahead_ns == 0 || step_ns_ == 0 || !base_.moves()) return;
  const Stopwatch stage;
  const int64_t count = (ahead_ns + kTrainedStep_ns - 1) / kTrainedStep_ns;
  sample(1, size_t(count), ahead_ns / count);
  add_residual(codes_ahead_.data() + (size_t(count) - 1) * codes_.size(), frame);
  count_ = 0;
  is_sampled_ = true;
  networks_ms_ = float(stage.elapsed_ms());
}

PredictorStats SampledPredictor::stats() const {
  PredictorStats stats = base_.stats();
  stats.networks_ms = networks_ms_;
  stats.sampled_frames = sampled_frames_;
  // All samples are decoded at the same time.
  stats.decoding_steps = sampled_frames_ == 0 ? 0 : sampled_frames_ / samples_ * cells();
  if (is_sampled_) stats.method = PredictionMethod::kSampled;
  return stats;
}

}  // namespace maq
