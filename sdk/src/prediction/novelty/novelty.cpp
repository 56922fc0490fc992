#include "prediction/novelty/novelty.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/clock.h"

namespace maq {
namespace {

constexpr float kFloor_bits = 0.035f;  // the noise of a still image

}  // namespace

Novelty::Novelty(std::shared_ptr<FrameEncoder> encoder, std::shared_ptr<CodeTransformer> transformer)
    : encoder_(std::move(encoder)),
      transformer_(std::move(transformer)),
      code_novelty_(encoder_->codes()),
      history_(encoder_->codes().count()),
      predicted_bits_(encoder_->codes().count()),
      codes_(encoder_->codes().count()),
      coming_(codes_.size()) {
  if (transformer_ != nullptr && transformer_->has_motion()) {
    motion_.emplace(encoder_);
    input_rgb_.resize(size_t(encoder_->frame_px()) * size_t(encoder_->frame_px()) * 3);
  }
  map_.reserve(encoder_->codes().cells());
  before_.reserve(kBefore + 1);
}

void Novelty::reset() {
  code_novelty_.reset();
  history_.clear();
  if (motion_) motion_->reset();
  before_.clear();
  map_.clear();
  has_frame_ = false;
}

bool Novelty::is_of_same_kind(const Frame& frame) const {
  return frame.image.format == format_ && frame.image.width_px == width_px_ && frame.image.height_px == height_px_;
}

bool Novelty::is_soon_after(const Frame& frame) const {
  if (frame.clock != clock_ || frame.timestamp_ns < timestamp_ns_) return false;
  // Both may have any value.
  return uint64_t(frame.timestamp_ns) - uint64_t(timestamp_ns_) <= uint64_t(kMaxInterval_ns);
}

float Novelty::ratio_of(float bits) const {
  if (before_.size() < kMinBefore) return 1;
  std::array<float, kBefore> sorted{};
  std::partial_sort_copy(before_.begin(), before_.end(), sorted.begin(), sorted.end());
  const size_t count = before_.size();
  const float median = (sorted[(count - 1) / 2] + sorted[count / 2]) / 2;
  return (bits + kFloor_bits) / (median + kFloor_bits);
}

const float* Novelty::predicted_bits(int64_t time_ns) {
  if (transformer_ == nullptr || history_.size() == 0) return nullptr;
  CodesBefore before;
  before.newest = codes_.data();
  history_.select(time_ns, transformer_->before(), before.frames.data());
  if (motion_) before.frames[transformer_->before()] = motion_->at(time_ns, codes_.data());
  before.step_s = float(double(time_ns - history_.newest_ns()) / 1e9);
  transformer_->bits(before, coming_.data(), predicted_bits_.data());
  return predicted_bits_.data();
}

NoveltyScore Novelty::push(const Frame& frame) {
  NoveltyTimes times;
  times.encoder = encoder_->encode(frame.image, coming_.data(), motion_ ? input_rgb_.data() : nullptr);
  NoveltyScore score;
  const bool is_of_other_kind = has_frame_ && !is_of_same_kind(frame);
  score.is_stream_start = !has_frame_ || is_of_other_kind || !is_soon_after(frame);
  Stopwatch stage;
  const float* const by_network = score.is_stream_start ? nullptr : predicted_bits(frame.timestamp_ns);
  if (by_network != nullptr) times.transformer_ms = float(stage.lap_ms());
  times_ = times;
  codes_.swap(coming_);
  if (score.is_stream_start) {
    code_novelty_.reset();
    history_.clear();
    if (motion_) motion_->reset();
    // Another format is compared with the recent frames; after a pause they are no reference.
    if (!is_of_other_kind) before_.clear();
  }
  map_.resize(encoder_->codes().cells());
  score.is_cut = code_novelty_.add(codes_.data(), by_network, map_.data());
  for (const float bits : map_) score.bits += bits / float(map_.size());
  score.ratio = ratio_of(score.bits);
  if (score.is_stream_start || score.is_cut) {
    before_.clear();
  } else {
    before_.push_back(score.bits);
    if (before_.size() > kBefore) before_.erase(before_.begin());
  }
  if (score.is_cut) {
    history_.clear();
    if (motion_) motion_->reset();
  }
  history_.add(codes_.data(), frame.timestamp_ns);
  if (motion_) motion_->add(input_rgb_.data(), frame.timestamp_ns);
  has_frame_ = true;
  format_ = frame.image.format;
  width_px_ = frame.image.width_px;
  height_px_ = frame.image.height_px;
  clock_ = frame.clock;
  timestamp_ns_ = frame.timestamp_ns;
  return score;
}

}  // namespace maq
