#include "prediction/networks/network_predictor.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/clock.h"
#include "core/error.h"

namespace maq {
namespace {

// Grey levels that the mended picture is taken to differ by int8 alone.
constexpr float kNoise = 0.5f;

}  // namespace

NetworkPredictor::NetworkPredictor(PredictionNetworks networks, const NetworkSettings& settings, int threads)
    : networks_(std::move(networks)),
      settings_(settings),
      base_({MAQ_PREDICTION_AUTO, threads, networks_.workspaces}),
      threads_(threads),
      history_(networks_.encoder->codes().count()),
      pictures_(size_t(networks_.encoder->frame_px()) * size_t(networks_.encoder->frame_px()) * 3),
      motion_(networks_.encoder),
      codes_(networks_.encoder->codes().count()),
      base_codes_(codes_.size()) {
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
  count_ = 0;
}

void NetworkPredictor::push(const Frame& frame) {
  const bool has_codes = settings_.mode != NetworkMode::kMended;
  count_ = 0;
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

size_t NetworkPredictor::codes_at(size_t sample, size_t number) const {
  if (sample >= samples_ || number < 1 || number > count_) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Frame ", number, " of sample ", sample, " was asked for, but ", count_,
                " frames (from 1) of ", samples_, " samples (from 0) were drawn since the latest frame.");
  }
  return ((number - 1) * samples_ + sample) * codes_.size();
}

void NetworkPredictor::draw(size_t samples, size_t count, int64_t step_ns) {
  count_ = samples_ = steps_ = 0;
  counts_ = {};
  networks_ms_ = 0;
  if (settings_.mode != NetworkMode::kDrawn) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "This predictor draws no samples; make one whose network_mode does.");
  }
  if (!has_frame_) throw Error(MAQ_ERROR_INVALID_ARGUMENT, "No frame was pushed; push those of the stream first.");
  const size_t of_frame = codes_.size();
  drawn_.resize(count * samples * of_frame);
  entropy_.assign(drawn_.size(), 0.0f);
  if (step_ns_ == 0 || !base_.moves()) {
    for (size_t i = 0; i < drawn_.size(); i += of_frame)
      std::copy(codes_.begin(), codes_.end(), drawn_.begin() + std::ptrdiff_t(i));
  } else {
    Stopwatch stage;
    CodeTransformer& transformer = *networks_.transformer;
    histories_.assign(samples, history_);
    before_.assign(samples, {});
    uint16_t* codes = drawn_.data();
    for (size_t k = 1; k <= count; ++k, codes += samples * of_frame) {
      const int64_t time_ns = newest_ns_ + int64_t(k) * step_ns;
      // Of the true frames: it is worth 1 to 2 dB more than that of a sample's own.
      const uint16_t* const moved = transformer.has_motion() ? motion_.at(time_ns, codes_.data()) : nullptr;
      for (size_t s = 0; s < samples; ++s) {
        const uint16_t* const latest = codes - (samples - s) * of_frame;
        if (k > 1) histories_[s].add(latest, time_ns - step_ns);
        CodesBefore& before = before_[s];
        before = {};
        before.newest = k == 1 ? codes_.data() : latest;
        before.step_s = float(double(step_ns) / 1e9);
        // Of the first frame all see the same.
        histories_[k == 1 ? 0 : s].select(time_ns, transformer.before(), before.frames.data());
        if (transformer.has_motion()) before.frames[transformer.before()] = moved;
      }
      const DrawCounts counts =
          transformer.draw(before_, settings_.sampling, uint32_t(base_.stats().pushed), uint32_t(k), settings_.passes,
                           codes, entropy_.data() + (codes - drawn_.data()));
      counts_.steps += counts.steps;
      counts_.passes += counts.passes;
    }
    networks_ms_ = float(stage.lap_ms());
    steps_ = samples * count;
  }
  samples_ = samples;
  count_ = count;
  drawn_step_ns_ = step_ns;
}

void NetworkPredictor::add_made(Frame& frame) {
  networks_.encoder->run(frame.image, base_codes_.data());
  networks_.decoder->picture(base_codes_.data(), of_base_.data());
  for (size_t i = 0; i < made_.size(); ++i) made_[i] -= of_base_[i];
  difference_.add(made_.data(), networks_.encoder->frame_px(), frame.image, threads_, frame.storage.data());
}

void NetworkPredictor::drawn_picture(size_t sample, size_t number, Frame& frame) {
  const size_t at = codes_at(sample, number);
  base_.predict(int64_t(number) * drawn_step_ns_, frame);
  if (steps_ == 0) return;  // nothing moves
  networks_.decoder->picture(drawn_.data() + at, made_.data());
  add_made(frame);
}

void NetworkPredictor::drawn_entropy(size_t sample, size_t number, float* bits) const {
  const size_t at = codes_at(sample, number), slices = networks_.encoder->codes().slices;
  for (size_t place = 0; place < places(); ++place) {
    bits[place] = 0;
    for (size_t k = 0; k < slices; ++k) bits[place] += entropy_[at + place * slices + k] / float(slices);
  }
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
  count_ = steps_ = 0;
  counts_ = {};
  if (ahead_ns == 0 || step_ns_ == 0 || !base_.moves()) return;
  Stopwatch stage;
  switch (settings_.mode) {
    case NetworkMode::kMended:
      networks_.encoder->squeeze(frame.image, squeezed_.data());
      mend(ahead_ns);
      counts_.passes = 1;
      for (size_t i = 0; i < made_.size(); ++i) {
        const float difference = made_[i] - float(squeezed_[i]);
        made_[i] = difference - std::clamp(difference, -kNoise, kNoise);
      }
      difference_.add(made_.data(), networks_.encoder->frame_px(), frame.image, threads_, frame.storage.data());
      break;
    case NetworkMode::kExpected:
      foresee(ahead_ns);
      counts_.passes = 1;
      networks_.decoder->picture(features_.data(), made_.data());
      add_made(frame);
      break;
    case NetworkMode::kDrawn: {
      const int64_t count = (ahead_ns + kTrainedStep_ns - 1) / kTrainedStep_ns;
      draw(1, size_t(count), ahead_ns / count);
      networks_.decoder->picture(drawn_.data() + (size_t(count) - 1) * codes_.size(), made_.data());
      add_made(frame);
      count_ = 0;
      break;
    }
  }
  networks_ms_ = float(stage.lap_ms());
}

}  // namespace maq
