#include "prediction/networks/network_predictor.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/clock.h"

namespace maq {
namespace {

constexpr int64_t kLongestStep_ns = 100000000;  // of drawn frames: the transformer was trained up to that

// How much of what the mended picture changes is taken, and how many grey levels less: the mean of two predictions is
// better than either, and at full size motion is more exact than the network has learnt; the rest is noise of int8.
// Chosen on validation clips of `pushing` and five real ones (docs/prediction.md).
constexpr float kTrust = 0.5f, kNoise = 0.5f;

}  // namespace

NetworkPredictor::NetworkPredictor(PredictionNetworks networks, const NetworkSettings& settings, int threads)
    : networks_(std::move(networks)),
      settings_(settings),
      base_({MAQ_PREDICTION_AUTO, threads}),
      threads_(threads),
      history_(networks_.encoder->codes().count()),
      drawn_history_(history_),
      pictures_(size_t(networks_.encoder->frame_px()) * size_t(networks_.encoder->frame_px()) * 3),
      motion_(networks_.encoder),
      codes_(networks_.encoder->codes().count()),
      base_codes_(codes_.size()),
      drawn_(codes_.size()) {
  const auto side_px = size_t(networks_.encoder->frame_px());
  squeezed_.resize(side_px * side_px * 3);
  made_.resize(squeezed_.size());
  of_base_.resize(squeezed_.size());
  features_.resize(codes_.size() * networks_.encoder->codes().width);
}

void NetworkPredictor::reset() {
  base_.reset();
  history_.clear();
  pictures_.clear();
  motion_.reset();
  has_frame_ = false;
  step_ns_ = 0;
}

void NetworkPredictor::push(const Frame& frame) {
  const bool has_codes = settings_.mode != NetworkMode::kMended;
  Stopwatch stage;
  if (has_codes) {
    networks_.encoder->run(frame.image, codes_.data(), squeezed_.data());
  } else {
    networks_.encoder->squeeze(frame.image, squeezed_.data());
  }
  networks_ms_ = float(stage.lap_ms());
  base_.push(frame);
  if (base_.stats().resets != resets_) {
    resets_ = base_.stats().resets;
    history_.clear();
    pictures_.clear();
    motion_.reset();
    has_frame_ = false;
  }
  if (has_frame_ && frame.timestamp_ns == newest_ns_) return;  // again; what is known of the first stays
  step_ns_ = has_frame_ ? frame.timestamp_ns - newest_ns_ : 0;
  newest_ns_ = frame.timestamp_ns;
  has_frame_ = true;
  if (has_codes) {
    history_.add(codes_.data(), newest_ns_);
    motion_.add(squeezed_.data(), newest_ns_);
  } else {
    pictures_.add(squeezed_.data(), newest_ns_);
  }
}

void NetworkPredictor::mend(int64_t ahead_ns) {
  std::array<const uint8_t*, MendedPicture::kMaxBefore> frames{};
  MendedPicture& mended = *networks_.mended;
  pictures_.select(newest_ns_ + step_ns_, mended.before(), frames.data());
  mended.run(frames.data(), squeezed_.data(), float(double(step_ns_) / 1e9), float(double(ahead_ns) / 1e9),
             made_.data());
}

void NetworkPredictor::draw(int64_t ahead_ns) {
  const auto count = std::max<int64_t>(1, (ahead_ns + kLongestStep_ns - 1) / kLongestStep_ns);
  drawn_history_ = history_;
  std::copy(codes_.begin(), codes_.end(), drawn_.begin());
  CodeTransformer& transformer = *networks_.transformer;
  for (int64_t k = 1; k <= count; ++k) {
    const int64_t time_ns = newest_ns_ + ahead_ns * k / count;
    CodesBefore before;
    base_codes_ = drawn_;
    before.newest = base_codes_.data();
    drawn_history_.select(time_ns, transformer.before(), before.frames.data());
    if (transformer.has_motion()) before.frames[transformer.before()] = motion_.at(time_ns, codes_.data());
    before.step_s = float(double(ahead_ns) / double(count) / 1e9);
    transformer.draw(before, settings_.sampling, uint32_t(k), frame_, 1, drawn_.data());
    drawn_history_.add(drawn_.data(), time_ns);
  }
  ++frame_;
  steps_ = size_t(count);
}

void NetworkPredictor::foresee(int64_t ahead_ns) {
  ContextFrames frames{};
  ExpectedFrame& expected = *networks_.expected;
  history_.select(newest_ns_ + step_ns_, expected.before(), frames.data());
  if (expected.has_motion()) frames[expected.before()] = motion_.at(newest_ns_ + ahead_ns, codes_.data());
  expected.run(frames, float(double(step_ns_) / 1e9), float(double(ahead_ns) / 1e9), features_.data());
}

void NetworkPredictor::predict(int64_t ahead_ns, Frame& frame) {
  base_.predict(ahead_ns, frame);
  networks_ms_ = 0;
  steps_ = 0;
  if (ahead_ns == 0 || step_ns_ == 0 || !base_.moves()) return;
  Stopwatch stage;
  switch (settings_.mode) {
    case NetworkMode::kMended:
      networks_.encoder->squeeze(frame.image, squeezed_.data());
      mend(ahead_ns);
      break;
    case NetworkMode::kExpected:
      foresee(ahead_ns);
      networks_.decoder->picture(features_.data(), made_.data());
      break;
    case NetworkMode::kDrawn:
      draw(ahead_ns);
      networks_.decoder->picture(drawn_.data(), made_.data());
      break;
  }
  if (settings_.mode == NetworkMode::kMended) {
    for (size_t i = 0; i < made_.size(); ++i) {
      const float difference = (made_[i] - float(squeezed_[i])) * kTrust;
      made_[i] = difference - std::clamp(difference, -kNoise, kNoise);
    }
  } else {
    networks_.encoder->run(frame.image, base_codes_.data());
    networks_.decoder->picture(base_codes_.data(), of_base_.data());
    for (size_t i = 0; i < made_.size(); ++i) made_[i] -= of_base_[i];
  }
  difference_.add(made_.data(), networks_.encoder->frame_px(), frame.image, threads_, frame.storage.data());
  networks_ms_ = float(stage.lap_ms());
}

}  // namespace maq
