#include "prediction/health/health_rules.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr float kUnexplained = 0.5f;  // of a patch

// Equal to the frame before: three equal frames, which also last for some time, since compressed films of a still
// scene repeat some. Without usable times more frames count.
constexpr int kFrozenFrames = 2, kFrozenFramesAlone = 9;
constexpr int64_t kFrozenTime_ns = 300000000;
constexpr float kBlackBrightest = 40, kBlackDeviation = 6;    // grey levels
constexpr float kLostDetail = 0.25f, kRegainedDetail = 0.2f;  // of the patches that usually have some
constexpr float kMinDetailFraction = 0.15f;                   // of patches: below, lost detail says nothing
constexpr float kLargelyFlat = 0.5f;                          // of patches
constexpr float kUsualRate = 1.0f / 30;                       // of the running mean of flat patches

// A disturbance begins with patches that nothing explains where none were, or with a jump of the whole picture.
constexpr float kNewFraction = 0.02f;
constexpr float kJump = 0.02f, kJumpRatio = 3, kJumpFraction = 0.5f;
constexpr float kCalmFraction = 0.1f, kCalmRatio = 1.5f, kCalmShift = 0.008f;
constexpr size_t kMinBefore = 4;  // frames: before, nothing is known to be usual
constexpr int kRestFrames = 4, kMaxDisturbedFrames = 30;

// Limits for the change from before a disturbance to after it.
constexpr float kSceneFraction = 0.42f;  // unexplained in the first frame of another scene
constexpr float kWholePicture = 0.8f;    // no hand covers so much in one frame
constexpr float kAroundCut = 0.5f;       // as a part of it, unexplained in the frames before and after
constexpr float kAbruptRatio = 0.6f, kMuchWorse = 2;
constexpr float kMovedShift = 0.06f, kKnockFraction = 0.33f;
constexpr float kObjectFraction = 0.02f, kMinNewOfObject = 0.035f, kStillFraction = 0.4f;

// The motion of the whole picture, in fractions of its width; 0 where it has none in common.
float shift_of(const PictureMatch& match) {
  return match.shift_fraction() >= kJumpFraction ? std::hypot(match.shift_x(), match.shift_y()) : 0;
}

}  // namespace

void HealthRules::reset() {
  has_frame_ = is_unsteady_ = false;
  equal_frames_ = disturbed_frames_ = 0;
  state_ = CameraEvent::kNone;
  next_ = known_ = 0;
}

float HealthRules::new_fraction(const PictureMatch& match) const {
  const std::vector<float>& now = match.unexplained();
  if (now.empty()) return 0;
  size_t count = 0;
  for (size_t i = 0; i < now.size(); ++i) {
    bool is_new = now[i] > kUnexplained;
    const int row = int(i) / match.columns(), column = int(i) % match.columns();
    for (size_t frame = 0; frame < known_ && is_new; ++frame) {
      for (int y = std::max(row - 1, 0); y <= std::min(row + 1, match.rows() - 1); ++y) {
        for (int x = std::max(column - 1, 0); x <= std::min(column + 1, match.columns() - 1); ++x) {
          is_new &= unexplained_[frame][size_t(y * match.columns() + x)] <= kUnexplained;
        }
      }
    }
    count += is_new ? 1 : 0;
  }
  return float(count) / float(now.size());
}

bool HealthRules::is_disturbed(const PictureMatch& match) const {
  if (known_ < kMinBefore) return match.unexplained_fraction() >= kSceneFraction;
  if (new_fraction(match) >= kNewFraction) return true;
  const float usual = *std::max_element(shifts_.begin(), shifts_.begin() + ptrdiff_t(known_));
  return shift_of(match) >= std::max(kJump, kJumpRatio * usual);
}

bool HealthRules::is_calm(const PictureMatch& match) const {
  float usual = 0, usual_shift = 0;
  for (size_t i = 0; i < known_; ++i) {
    usual = std::max(usual, fractions_[i]);
    usual_shift = std::max(usual_shift, shifts_[i]);
  }
  return match.unexplained_fraction() <= std::max(kCalmFraction, kCalmRatio * usual) &&
         shift_of(match) <= std::max(kCalmShift, kCalmRatio * usual_shift);
}

void HealthRules::remember(const PictureMatch& match) {
  unexplained_[next_] = match.unexplained();
  fractions_[next_] = match.unexplained_fraction();
  shifts_[next_] = shift_of(match);
  next_ = (next_ + 1) % kBefore;
  known_ = std::min(known_ + 1, kBefore);
}

void HealthRules::forget_usual() { known_ = next_ = 0; }

bool HealthRules::lost_detail(float flat_fraction) const {
  const float usual = 1 - usual_flat_fraction_;
  const float limit = state_ == CameraEvent::kCovered ? kRegainedDetail : kLostDetail;
  return usual >= kMinDetailFraction && flat_fraction - usual_flat_fraction_ >= limit * usual;
}

// The rest of the picture is still there, unless most of it is covered.
bool HealthRules::is_covered(const PictureMatch& change) const {
  return lost_detail(change.flat_fraction()) &&
         (change.flat_fraction() >= kLargelyFlat || change.explained_detail_fraction() >= 0.5f);
}

// The first frame is the worst, at places where all was explained before.
bool HealthRules::is_abrupt() const {
  return new_fraction_ >= kMinNewOfObject && other_fraction_ <= kAbruptRatio * peak_fraction_;
}

// An object stays where it is, or moves with the picture; what passes does not.
bool HealthRules::find_object(const PictureMatch& since_rest, HealthResult& result) const {
  float x = 0, y = 0, count = 0, still = 0;
  for (size_t i = 0; i < change_.unexplained().size(); ++i) {
    if (change_.unexplained()[i] <= kUnexplained) continue;
    const int column = int(i) % change_.columns(), row = int(i) / change_.columns();
    x += float(column);
    y += float(row);
    count += 1;
    still += since_rest.unexplained()[i] <= kUnexplained && since_rest.is_at_rest(i) ? 1.0f : 0.0f;
  }
  if (change_.unexplained_fraction() < kObjectFraction || still < kStillFraction * count) return false;
  result.object_x = (x / count + 0.5f) / float(change_.columns());
  result.object_y = (y / count + 0.5f) / float(change_.rows());
  return true;
}

// The picture has rested for some frames.
void HealthRules::name_event(const SmallPicture& picture, const PictureMatch& match, HealthResult& result) {
  if (lost_detail(match.flat_fraction()) && is_covered(change_)) {
    result.event = state_ = CameraEvent::kCovered;
    return;
  }
  const float shift = std::hypot(change_.shift_x(), change_.shift_y());
  if (change_.shift_fraction() >= kKnockFraction && shift >= kMovedShift) {
    result.event = CameraEvent::kMoved;
    result.shift_x = change_.shift_x();
    result.shift_y = change_.shift_y();
    return;
  }
  since_rest_.find(picture, rest_);
  if (is_abrupt() && find_object(since_rest_, result)) result.event = CameraEvent::kObject;
}

void HealthRules::begin_disturbance(const SmallPicture& before, const PictureMatch& match, int64_t time_ns) {
  calm_ = before;
  disturbed_frames_ = 1;
  disturbed_ns_ = time_ns;
  peak_fraction_ = match.unexplained_fraction();
  new_fraction_ = new_fraction(match);
  peak_shift_ = shift_of(match);
  other_fraction_ = 0;
  rest_frames_ = 0;
}

// Something larger happens meanwhile.
bool HealthRules::is_much_worse(const PictureMatch& match) const {
  const float shift = shift_of(match);
  if (std::max(peak_shift_, shift) >= kJump) return peak_shift_ < kJump && shift >= kJumpRatio * peak_shift_;
  return match.unexplained_fraction() >=
         std::max(kMinNewOfObject, kMuchWorse * std::max(peak_fraction_, other_fraction_));
}

// One frame does not follow from the one before, but the frames before it do, and the frames after it. change_ was
// found.
bool HealthRules::is_cut(const PictureMatch& match) {
  return disturbed_frames_ == 2 && peak_fraction_ >= kSceneFraction &&
         std::max(fraction_before_, match.unexplained_fraction()) <= kAroundCut * peak_fraction_ &&
         change_.unexplained_fraction() >= kSceneFraction && change_.shift_fraction() < kKnockFraction &&
         (peak_fraction_ >= kWholePicture || !is_covered(change_));
}

void HealthRules::follow_disturbance(const SmallPicture& picture, const PictureMatch& match, HealthResult& result) {
  ++disturbed_frames_;
  rest_frames_ = is_calm(match) ? rest_frames_ + 1 : 0;
  if (rest_frames_ == 0) other_fraction_ = std::max(other_fraction_, match.unexplained_fraction());
  peak_shift_ = std::max(peak_shift_, shift_of(match));
  if (rest_frames_ == 1) rest_ = picture;
  if (rest_frames_ == 1 || disturbed_frames_ == 2) change_.find(picture, calm_);
  if (is_cut(match)) {
    result.event = CameraEvent::kCut;
  } else if (rest_frames_ == kRestFrames) {
    name_event(picture, match, result);
  }
  if (result.event != CameraEvent::kNone) {
    result.began_ns = disturbed_ns_;
    forget_usual();
  }
  if (result.event == CameraEvent::kCut || result.event == CameraEvent::kMoved)
    usual_flat_fraction_ = match.flat_fraction();
  if (result.event != CameraEvent::kNone || rest_frames_ == kRestFrames) {
    disturbed_frames_ = 0;
  } else if (disturbed_frames_ > kMaxDisturbedFrames) {
    disturbed_frames_ = 0;
    is_unsteady_ = true;
  }
}

bool HealthRules::find_outage(bool is_equal, const PictureBrightness& brightness, int64_t time_ns,
                              HealthResult& result) {
  equal_frames_ = is_equal && has_frame_ ? equal_frames_ + 1 : 0;
  if (equal_frames_ == 0) equal_since_ns_ = time_ns;
  const bool is_black = brightness.brightest < kBlackBrightest && brightness.deviation < kBlackDeviation;
  const bool has_lasted = uint64_t(time_ns) - uint64_t(equal_since_ns_) >= uint64_t(kFrozenTime_ns);
  const bool is_frozen = equal_frames_ >= kFrozenFrames && (has_lasted || equal_frames_ >= kFrozenFramesAlone);
  const CameraEvent before = state_;
  const bool was_out = before == CameraEvent::kBlack || before == CameraEvent::kFreeze;
  if (!is_black && !is_frozen) {
    // The camera may show anything now.
    if (was_out) reset();
    return false;
  }
  state_ = is_black ? CameraEvent::kBlack : CameraEvent::kFreeze;
  if (state_ != before) {
    result.event = state_;
    result.began_ns = is_black ? time_ns : equal_since_ns_;
  }
  has_frame_ = true;
  disturbed_frames_ = 0;
  return true;
}

HealthResult HealthRules::add(const SmallPicture& picture, const SmallPicture& before, const PictureMatch& match,
                              bool is_equal, const PictureBrightness& brightness, int64_t time_ns) {
  HealthResult result;
  result.is_stream_start = !has_frame_;
  result.unexplained = match.unexplained_fraction();
  if (find_outage(is_equal, brightness, time_ns, result)) {
    result.state = state_;
    return result;
  }
  if (!has_frame_) {
    has_frame_ = true;
    usual_flat_fraction_ = match.flat_fraction();
    fraction_before_ = latest_fraction_ = 0;
    return result;
  }
  if (state_ == CameraEvent::kCovered && !lost_detail(match.flat_fraction())) {
    state_ = CameraEvent::kNone;
    disturbed_frames_ = 0;
    forget_usual();
  }
  if (disturbed_frames_ > 0 && !is_much_worse(match)) {
    follow_disturbance(picture, match, result);
  } else if (is_unsteady_) {
    is_unsteady_ = !is_calm(match);
  } else if (disturbed_frames_ > 0 || is_disturbed(match)) {
    fraction_before_ = latest_fraction_;
    begin_disturbance(before, match, time_ns);
  }
  latest_fraction_ = match.unexplained_fraction();
  if (disturbed_frames_ == 0) {
    remember(match);
    if (state_ != CameraEvent::kCovered)
      usual_flat_fraction_ += kUsualRate * (match.flat_fraction() - usual_flat_fraction_);
  }
  result.state = state_;
  return result;
}

}  // namespace maq
