#include "prediction/predictor.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/clock.h"
#include "core/error.h"

namespace maq {
namespace {

constexpr const char* kNoFrame = "No frame was pushed yet, so there is nothing to predict from; push one first.";

// Of a frame's contrast, what is left along the flow where the one before shows something else: 0.8 to 0.9 between
// unrelated clips, under 0.1 within them. Noise does not go on either.
constexpr float kCutFraction = 0.3f;

// From one time to another that may be anywhere; nothing where that is not 0 to kMaxInterval_ns.
std::optional<int64_t> interval(int64_t from_ns, int64_t to_ns) {
  int64_t found = 0;
  if (__builtin_sub_overflow(to_ns, from_ns, &found) || found < 0 || found > Predictor::kMaxInterval_ns) return {};
  return found;
}

bool is_same_kind(const ImageView& one, const ImageView& other) {
  return one.format == other.format && one.width_px == other.width_px && one.height_px == other.height_px;
}

}  // namespace

Predictor::Predictor(const PredictorSettings& settings) : settings_(settings), threads_(settings.threads) {}

PredictorWorkspaces::Borrowed Predictor::borrow() {
  return (settings_.workspaces != nullptr ? *settings_.workspaces : own_workspaces_).borrow();
}

void Predictor::reset() {
  has_frame_ = has_before_ = moves_ = false;
  interval_ns_ = 0;
  method_weights_.reset();
}

void Predictor::keep(const Frame& frame) {
  require_picture(frame.image);
  const Stopwatch whole;
  is_again_ = false;
  if (has_frame_) {
    const std::optional<int64_t> since = interval(newest_.timestamp_ns, frame.timestamp_ns);
    is_again_ = since == 0;
    if (!since || !is_same_kind(frame.image, newest_.image) || frame.clock != newest_.clock) {
      is_again_ = false;
      reset();
      ++stats_.resets;
    }
  }
  if (has_frame_ && !is_again_) {
    if (has_grey_) {
      before_grey_.resize(newest_grey_.size());
      std::transform(newest_grey_.begin(), newest_grey_.end(), before_grey_.begin(),
                     [](float grey) { return uint8_t(grey + 0.5f); });
    }
    before_ns_ = newest_.timestamp_ns;
    has_before_ = has_grey_;
  }
  has_frame_ = has_grey_ = false;  // until all of it is known
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

void Predictor::follow() {
  if (!has_frame_) return;
  const Stopwatch whole;
  Stopwatch stage;
  stats_.grey_ms = stats_.flow_ms = stats_.choice_ms = 0;
  if (settings_.method != MAQ_PREDICTION_LAST) {
    const PredictorWorkspaces::Borrowed work = borrow();
    work->now.set(newest_.image, threads_);
    const GreyLevel& finest = work->now.level(0);
    scale_ = work->now.scale();
    if (has_before_) {
      if (is_again_) std::copy(before_grey_.begin(), before_grey_.end(), newest_grey_.begin());
      work->before.set_finest(newest_grey_.data(), finest.width_px, finest.height_px, scale_);
    }
    newest_grey_.resize(size_t(finest.width_px) * size_t(finest.height_px));
    work->now.copy_finest(newest_grey_.data());
    has_grey_ = true;
    stats_.grey_ms = float(stage.lap_ms());
    if (has_before_) {
      const FlowFit fit = work->optical_flow.find(work->now, work->before, threads_, work->flow);
      if (fit.moved > kCutFraction * fit.contrast) {
        method_weights_.reset();
        has_before_ = false;
        ++stats_.resets;
      } else {
        interval_ns_ = newest_.timestamp_ns - before_ns_;
        moves_ = flow_.pack(work->flow);
      }
    }
    stats_.flow_ms = float(stage.lap_ms());
    if (settings_.method == MAQ_PREDICTION_AUTO && !is_again_) {
      method_weights_.add(work->now, newest_.timestamp_ns, work->flow, interval_ns_, threads_, work->methods);
      stats_.choice_ms = float(stage.lap_ms());
    }
  }
  ++stats_.pushed;
  stats_.push_ms += float(whole.elapsed_ms());
}

void Predictor::predict(int64_t ahead_ns, Frame& frame) {
  if (!has_frame_) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, kNoFrame);
  }
  if (ahead_ns < 0 || ahead_ns > kMaxAhead_ns) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The time ahead is ", double(ahead_ns) / 1e9, " s, but must be 0 to ",
                kMaxAhead_ns / 1000000000, " s.");
  }
  const Stopwatch whole;
  Stopwatch stage;
  maq_prediction_method method = settings_.method;
  if (!moves_ || ahead_ns == 0) method = MAQ_PREDICTION_LAST;
  const CellWeights* weights = nullptr;
  float motion_fraction = method == MAQ_PREDICTION_LAST ? 0.0f : 1.0f;
  if (method == MAQ_PREDICTION_AUTO) {
    weights = &method_weights_.at(ahead_ns);
    motion_fraction = weights->mean;
    if (motion_fraction == 0) method = MAQ_PREDICTION_LAST;
    if (motion_fraction == 1) method = MAQ_PREDICTION_MOTION, weights = nullptr;
  }
  const ImageView& image = newest_.image;
  frame.clear();
  uint8_t* const pixels = frame.allocate(image.format, image.width_px, image.height_px);
  stats_.project_ms = 0;
  if (method != MAQ_PREDICTION_LAST) {
    const float intervals = float(double(ahead_ns) / double(interval_ns_));
    const PredictorWorkspaces::Borrowed work = borrow();
    flow_.unpack(work->flow);
    const FlowField& field = work->extrapolation.project(work->flow, intervals);
    stats_.project_ms = float(stage.lap_ms());
    work->extrapolation.fetch(image, field, scale_, weights, threads_, pixels);
  } else {
    copy_packed(image, pixels);
  }
  stats_.fetch_ms = float(stage.lap_ms());
  if (__builtin_add_overflow(newest_.timestamp_ns, ahead_ns, &frame.timestamp_ns)) frame.timestamp_ns = INT64_MAX;
  frame.clock = newest_.clock;
  frame.sequence = newest_.sequence;
  frame.origin = {true, newest_.timestamp_ns, newest_.sequence, ahead_ns};
  stats_.method = method;
  stats_.motion_fraction = motion_fraction;
  ++stats_.predicted;
  stats_.predict_ms = float(whole.elapsed_ms());
}

}  // namespace maq
