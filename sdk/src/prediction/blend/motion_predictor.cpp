#include "prediction/blend/motion_predictor.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "core/clock.h"
#include "core/error.h"

namespace maq {
namespace {

constexpr const char* kNoFrame = "No frame was pushed yet, so there is nothing to predict from; push one first.";

// Fraction of a frame's contrast that the flow leaves unexplained when the frame before shows another scene. It is 0.8
// to 0.9 between unrelated clips and below 0.1 within a clip. Noise does not continue either.
constexpr float kCutFraction = 0.3f;

// Returns the time between two timestamps of any value; nothing unless it is 0 to kMaxInterval_ns.
std::optional<int64_t> interval(int64_t from_ns, int64_t to_ns) {
  int64_t found = 0;
  if (__builtin_sub_overflow(to_ns, from_ns, &found) || found < 0 || found > MotionPredictor::kMaxInterval_ns)
    return {};
  return found;
}

// Repeats in a row that are taken for missing frames. From the next on, nothing moves.
constexpr int kMaxRepeats = 1;

bool has_same_pixels(const ImageView& one, const ImageView& other) {
  for (int plane = 0; plane < plane_count(one.format); ++plane) {
    const size_t bytes = row_bytes(one.format, plane, one.width_px);
    const uint8_t *row = one.planes[plane].data, *other_row = other.planes[plane].data;
    for (int y = 0; y < plane_rows(one.format, plane, one.height_px); ++y) {
      if (std::memcmp(row, other_row, bytes) != 0) return false;
      row += one.planes[plane].stride_bytes;
      other_row += other.planes[plane].stride_bytes;
    }
  }
  return true;
}

bool is_same_kind(const ImageView& one, const ImageView& other) {
  return one.format == other.format && one.width_px == other.width_px && one.height_px == other.height_px;
}

}  // namespace

MotionPredictor::MotionPredictor(const MotionSettings& settings) : settings_(settings), threads_(settings.threads) {}

MotionWorkspaces::Borrowed MotionPredictor::borrow() {
  return (settings_.workspaces != nullptr ? *settings_.workspaces : own_workspaces_).borrow();
}

void MotionPredictor::reset() {
  has_frame_ = has_before_ = moves_ = is_repeat_ = false;
  repeats_ = 0;
  interval_ns_ = 0;
  blend_weights_.reset();
}

bool MotionPredictor::continues(const Frame& frame) {
  is_again_ = false;
  if (!has_frame_) return true;
  const std::optional<int64_t> since = interval(latest_ns_, frame.timestamp_ns);
  if (!since || !is_same_kind(frame.image, newest_.image) || frame.clock != newest_.clock) return false;
  is_again_ = since == 0 && !is_repeat_;
  return true;
}

bool MotionPredictor::is_lone_repeat(const Frame& frame) const {
  return has_frame_ && moves_ && !is_again_ && repeats_ < kMaxRepeats && has_same_pixels(frame.image, newest_.image);
}

void MotionPredictor::keep(const Frame& frame) {
  require_no_depth(frame.image);
  const Stopwatch whole;
  if (!continues(frame)) {
    reset();
    ++stats_.resets;
  }
  is_repeat_ = is_lone_repeat(frame);
  latest_ns_ = frame.timestamp_ns;
  if (is_repeat_) {
    ++repeats_;
    newest_.sequence = frame.sequence;
    stats_.push_ms = float(whole.elapsed_ms());
    return;
  }
  repeats_ = 0;
  if (has_frame_ && !is_again_) {
    if (has_luma_) {
      before_luma_.resize(newest_luma_.size());
      std::transform(newest_luma_.begin(), newest_luma_.end(), before_luma_.begin(),
                     [](float luma) { return uint8_t(luma + 0.5f); });
    }
    before_ns_ = newest_.timestamp_ns;
    has_before_ = has_luma_;
  }
  has_frame_ = has_luma_ = false;  // until the whole frame is copied
  const ImageView& image = frame.image;
  const size_t bytes = packed_bytes(image.format, image.width_px, image.height_px);
  newest_.storage.resize(bytes + 1);
  copy_packed(image, newest_.storage.data());
  newest_.image = packed_view(image.format, image.width_px, image.height_px, newest_.storage.data());
  newest_.timestamp_ns = frame.timestamp_ns;
  newest_.clock = frame.clock;
  newest_.sequence = frame.sequence;
  has_frame_ = true;
  interval_ns_ = 0;
  moves_ = false;
  stats_.push_ms = float(whole.elapsed_ms());
}

void MotionPredictor::follow() {
  if (!has_frame_) return;
  const Stopwatch whole;
  stats_.luma_ms = stats_.flow_ms = stats_.weights_ms = 0;
  if (settings_.method != PredictionMethod::kLast && !is_repeat_) find_motion(*borrow());
  ++stats_.pushed;
  stats_.push_ms += float(whole.elapsed_ms());
}

void MotionPredictor::find_motion(MotionWorkspace& work) {
  Stopwatch stage;
  work.now.set(newest_.image, threads_);
  const LumaLevel& finest = work.now.level(0);
  scale_ = work.now.scale();
  if (has_before_) {
    if (is_again_) std::copy(before_luma_.begin(), before_luma_.end(), newest_luma_.begin());
    work.before.set_finest(newest_luma_.data(), finest.width_px, finest.height_px, scale_);
  }
  newest_luma_.resize(size_t(finest.width_px) * size_t(finest.height_px));
  work.now.copy_finest(newest_luma_.data());
  has_luma_ = true;
  stats_.luma_ms = float(stage.lap_ms());
  if (has_before_) {
    const FlowFit fit = work.optical_flow.find(work.now, work.before, threads_, work.flow);
    if (fit.moved > kCutFraction * fit.contrast) {
      blend_weights_.reset();
      has_before_ = false;
      ++stats_.resets;
    } else {
      interval_ns_ = newest_.timestamp_ns - before_ns_;
      moves_ = flow_.pack(work.flow);
    }
  }
  stats_.flow_ms = float(stage.lap_ms());
  if (settings_.method == PredictionMethod::kAuto && !is_again_) {
    blend_weights_.add(work.now, newest_.timestamp_ns, work.flow, interval_ns_, threads_, work.blend);
    stats_.weights_ms = float(stage.lap_ms());
  }
}

void MotionPredictor::predict(int64_t ahead_ns, Frame& frame) {
  if (!has_frame_) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, kNoFrame);
  }
  if (ahead_ns < 0 || ahead_ns > kMaxAhead_ns) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The time ahead is ", double(ahead_ns) / 1e9, " s, but must be 0 to ",
                kMaxAhead_ns / 1000000000, " s.");
  }
  const Stopwatch whole;
  Stopwatch stage;
  PredictionMethod method = settings_.method;
  if (!moves_ || ahead_ns == 0) method = PredictionMethod::kLast;
  const CellWeights* weights = nullptr;
  float motion_fraction = method == PredictionMethod::kLast ? 0.0f : 1.0f;
  if (method == PredictionMethod::kAuto) {
    weights = &blend_weights_.at(ahead_ns + latest_ns_ - newest_.timestamp_ns);
    motion_fraction = weights->mean;
    if (motion_fraction == 0) method = PredictionMethod::kLast;
    if (motion_fraction == 1) method = PredictionMethod::kMotion, weights = nullptr;
  }
  const ImageView& image = newest_.image;
  frame.clear();
  uint8_t* const pixels = frame.allocate(image.format, image.width_px, image.height_px);
  stats_.project_ms = 0;
  if (method != PredictionMethod::kLast) {
    const int64_t since_newest_ns = ahead_ns + latest_ns_ - newest_.timestamp_ns;
    const float intervals = float(double(since_newest_ns) / double(interval_ns_));
    const MotionWorkspaces::Borrowed work = borrow();
    flow_.unpack(work->flow);
    const FlowField& field = work->extrapolation.project(work->flow, intervals);
    stats_.project_ms = float(stage.lap_ms());
    work->extrapolation.warp(image, field, scale_, weights, threads_, pixels);
  } else {
    copy_packed(image, pixels);
  }
  stats_.warp_ms = float(stage.lap_ms());
  if (__builtin_add_overflow(latest_ns_, ahead_ns, &frame.timestamp_ns)) frame.timestamp_ns = INT64_MAX;
  frame.clock = newest_.clock;
  frame.sequence = newest_.sequence;
  frame.origin = {true, latest_ns_, newest_.sequence, ahead_ns};
  stats_.method = method;
  stats_.motion_fraction = motion_fraction;
  ++stats_.predicted;
  stats_.predict_ms = float(whole.elapsed_ms());
}

}  // namespace maq
