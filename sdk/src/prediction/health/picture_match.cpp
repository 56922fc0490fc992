#include "prediction/health/picture_match.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"

namespace maq {
namespace {

constexpr int kPatchStep_px = kPatch_px / 2;
constexpr int kReachX_px = 10, kReachY_px = 8;  // of the coarse search: a quarter of the width of a usual frame
// Motion may leave so much of a patch: a part of its own contrast, and noise (squared grey levels).
constexpr float kContrastPart = 0.3f, kNoise = 8;
constexpr float kFlatDetail = 8;       // squared grey levels: below, a patch has no detail but shading
constexpr float kDetailContrast = 25;  // from here on its motion is known
constexpr float kBrightnessNoise = 4;  // grey levels
constexpr float kStillResidual = 4;    // squared grey levels: no motion is searched
constexpr float kSameShift_px = 2, kFirstAgreement_px = 4;
constexpr int kCameraPasses = 3;
constexpr size_t kMinDetailed = 12;  // patches: fewer say nothing of the camera
constexpr float kMinPatches = 6, kMinShiftFraction = 0.3f;
constexpr float kDistanceCost = 0.02f;  // squared grey levels a squared pixel: of equal places the nearest

int count_of(int side_px) { return std::max(divide_up(side_px - kPatch_px, kPatchStep_px), 0) + 1; }
int patch_begin(int index, int side_px) { return std::min(index * kPatchStep_px, side_px - kPatch_px); }

// Mean square of the difference of two patches around its mean.
float residual_at(const float* one, size_t one_stride, const float* other, size_t other_stride) {
  float sums[kPatch_px] = {}, squares[kPatch_px] = {};
  for (int y = 0; y < kPatch_px; ++y, one += one_stride, other += other_stride) {
    for (int x = 0; x < kPatch_px; ++x) {
      const float difference = one[x] - other[x];
      sums[x] += difference;
      squares[x] += difference * difference;
    }
  }
  float sum = 0, square = 0;
  for (int x = 0; x < kPatch_px; ++x) sum += sums[x], square += squares[x];
  constexpr float kMean = 1.0f / (kPatch_px * kPatch_px);
  return square * kMean - sum * kMean * sum * kMean;
}

// Variance of a patch around the plane that fits it: shading is no detail.
float detail_at(const LumaLevel& level, int left, int top) {
  float sum = 0, squares = 0, along_x = 0, along_y = 0;
  for (int y = 0; y < kPatch_px; ++y) {
    const float* const row = level.at(left, top + y);
    for (int x = 0; x < kPatch_px; ++x) {
      const float u = float(x) - 0.5f * (kPatch_px - 1), v = float(y) - 0.5f * (kPatch_px - 1);
      sum += row[x], squares += row[x] * row[x], along_x += u * row[x], along_y += v * row[x];
    }
  }
  constexpr float kCount = kPatch_px * kPatch_px;
  constexpr float kSpread = kCount * (kPatch_px * kPatch_px - 1) / 12.0f;  // the sum of u * u
  return std::max((squares - sum * sum / kCount - (along_x * along_x + along_y * along_y) / kSpread) / kCount, 0.0f);
}

// At whole pixels: brightness changes slowly.
float mean_at(const LumaLevel& level, float x, float y) {
  constexpr int kOutside = LumaLevel::kBorder_px;
  const int left = std::clamp(int(std::lround(x)), -kOutside, level.width_px + kOutside - kPatch_px);
  const int top = std::clamp(int(std::lround(y)), -kOutside, level.height_px + kOutside - kPatch_px);
  float sum = 0;
  for (int row = top; row < top + kPatch_px; ++row) {
    for (int i = 0; i < kPatch_px; ++i) sum += level.at(left, row)[i];
  }
  return sum / (kPatch_px * kPatch_px);
}

float median(std::vector<float>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void SmallPicture::set(const LumaPyramid& frame) {
  size_t index = 0;
  scale_ = 1;
  const auto long_side = [&] { return std::max(frame.level(index).width_px, frame.level(index).height_px); };
  while (index + 1 < frame.level_count() && long_side() > kLongSide_px) ++index, scale_ *= 2;
  const LumaLevel& level = frame.level(index);
  luma_.resize(size_t(level.width_px) * size_t(level.height_px));
  for (int y = 0; y < level.height_px; ++y) {
    std::copy(level.at(0, y), level.at(level.width_px, y), luma_.data() + size_t(y) * size_t(level.width_px));
  }
  pyramid_.set_finest(luma_.data(), level.width_px, level.height_px, scale_);
}

void PictureMatch::search_coarsely(const LumaLevel& from, const LumaLevel& to) {
  coarse_columns_ = count_of(from.width_px);
  coarse_rows_ = count_of(from.height_px);
  coarse_.assign(size_t(coarse_columns_) * size_t(coarse_rows_), {0, 0});
  for (int row = 0; row < coarse_rows_; ++row) {
    for (int column = 0; column < coarse_columns_; ++column) {
      const int x = patch_begin(column, from.width_px), y = patch_begin(row, from.height_px);
      const float* const patch = from.at(x, y);
      float best = residual_at(patch, from.stride(), to.at(x, y), to.stride());
      if (best < kStillResidual) continue;
      Displacement& found = coarse_[size_t(row * coarse_columns_ + column)];
      // The other picture's border repeats its edge for some pixels: what moves out of the frame is followed so far.
      constexpr int kOutside_px = 2;
      const int left = std::max(-kReachX_px, -kOutside_px - x), top = std::max(-kReachY_px, -kOutside_px - y);
      const int right = std::min(kReachX_px, to.width_px + kOutside_px - kPatch_px - x);
      const int bottom = std::min(kReachY_px, to.height_px + kOutside_px - kPatch_px - y);
      for (int dy = top; dy <= bottom; ++dy) {
        for (int dx = left; dx <= right; ++dx) {
          const float cost = residual_at(patch, from.stride(), to.at(x + dx, y + dy), to.stride()) +
                             kDistanceCost * float(dx * dx + dy * dy);
          if (cost >= best) continue;
          best = cost;
          found = {float(dx), float(dy)};
        }
      }
    }
  }
}

// Light that changes everywhere is no event.
void PictureMatch::compare_brightness(const LumaLevel& from, const LumaLevel& to) {
  brightness_.resize(patches_.size());
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const size_t at = size_t(row * columns_ + column);
      const auto x = float(patch_begin(column, from.width_px));
      const auto y = float(patch_begin(row, from.height_px));
      brightness_[at] = mean_at(from, x, y) - mean_at(to, x + patches_[at].dx, y + patches_[at].dy);
    }
  }
  sorted_ = brightness_;
  const float everywhere = median(sorted_);
  for (float& difference : brightness_) difference -= everywhere;
}

Displacement PictureMatch::middle_of(size_t patch) const {
  const int column = int(patch) % columns_, row = int(patch) / columns_;
  return {float(patch_begin(column, width_px_)) + 0.5f * float(kPatch_px - width_px_),
          float(patch_begin(row, height_px_)) + 0.5f * float(kPatch_px - height_px_)};
}

bool PictureMatch::is_in_view(size_t patch) const {
  constexpr float kInside_px = kPatch_px / 2.0f - 1;
  const Displacement at = middle_of(patch), camera = camera_.at(at.dx, at.dy);
  return std::abs(at.dx + camera.dx) <= 0.5f * float(width_px_) - kInside_px &&
         std::abs(at.dy + camera.dy) <= 0.5f * float(height_px_) - kInside_px;
}

bool PictureMatch::is_at_rest(size_t patch) const {
  const Displacement middle = middle_of(patch), camera = camera_.at(middle.dx, middle.dy);
  const Patch& own = patches_[patch];
  return std::hypot(own.dx, own.dy) < kSameShift_px ||
         std::hypot(own.dx - camera.dx, own.dy - camera.dy) < kSameShift_px;
}

// Least squares over the patches that agree with the motion found before, first with the median.
void PictureMatch::find_camera_motion() {
  const auto is_known = [&](size_t i) { return patches_[i].contrast > kDetailContrast && unexplained_[i] < 0.5f; };
  const auto median_of = [&](float Patch::*displacement) {
    sorted_.clear();
    for (size_t i = 0; i < patches_.size(); ++i) {
      if (is_known(i)) sorted_.push_back(patches_[i].*displacement);
    }
    return median(sorted_);
  };
  camera_ = {median_of(&Patch::dx), median_of(&Patch::dy), 0, 0};
  float limit_px = kFirstAgreement_px;
  size_t known = 0, with_detail = 0, together = 0;
  for (int pass = 0; pass <= kCameraPasses; ++pass) {
    float count = 0, x = 0, y = 0, dx = 0, dy = 0, squares = 0, along = 0, across = 0;
    known = with_detail = together = 0;
    for (size_t i = 0; i < patches_.size(); ++i) {
      // A patch that came into view is not in the other picture.
      with_detail += patches_[i].contrast > kDetailContrast && is_in_view(i) ? 1 : 0;
      if (!is_known(i)) continue;
      ++known;
      const Displacement at = middle_of(i), camera = camera_.at(at.dx, at.dy);
      const Patch& own = patches_[i];
      if (std::hypot(own.dx - camera.dx, own.dy - camera.dy) > limit_px) continue;
      ++together;
      count += 1, x += at.dx, y += at.dy, dx += own.dx, dy += own.dy;
      squares += at.dx * at.dx + at.dy * at.dy;
      along += at.dx * own.dx + at.dy * own.dy;
      across += at.dx * own.dy - at.dy * own.dx;
    }
    if (pass == kCameraPasses || count < kMinPatches) break;
    // Around the means of the patches that agree.
    x /= count, y /= count, dx /= count, dy /= count;
    const float spread = squares / count - x * x - y * y;
    if (spread <= 1) break;
    camera_.zoom = (along / count - x * dx - y * dy) / spread;
    camera_.turn = (across / count - x * dy + y * dx) / spread;
    camera_.dx = dx - camera_.zoom * x + camera_.turn * y;
    camera_.dy = dy - camera_.turn * x - camera_.zoom * y;
    limit_px = kSameShift_px;
  }
  // Patches point back to where they were.
  shift_x_ = -camera_.dx / float(width_px_);
  shift_y_ = -camera_.dy / float(width_px_);
  shift_fraction_ = with_detail >= kMinDetailed ? float(together) / float(with_detail) : 0;
  explained_detail_fraction_ = with_detail > 0 ? float(known) / float(with_detail) : 1;
}

// Patches that the other picture does not show are not unexplained.
void PictureMatch::leave_out_what_came_into_view() {
  if (shift_fraction_ < kMinShiftFraction) return;
  for (size_t i = 0; i < patches_.size(); ++i) {
    if (!is_in_view(i)) unexplained_[i] = std::min(unexplained_[i], 0.5f);
  }
}

void PictureMatch::find(const SmallPicture& picture, const SmallPicture& other) {
  const LumaLevel &from = picture.fine(), &to = other.fine();
  unexplained_fraction_ = flat_fraction_ = shift_x_ = shift_y_ = shift_fraction_ = 0;
  const LumaLevel &coarse_from = picture.coarse(), &coarse_to = other.coarse();
  explained_detail_fraction_ = 1;
  camera_ = {};
  width_px_ = from.width_px;
  height_px_ = from.height_px;
  columns_ = rows_ = 0;
  unexplained_.clear();
  if (std::min(coarse_from.width_px, coarse_from.height_px) < kPatch_px) return;
  search_coarsely(coarse_from, coarse_to);
  columns_ = count_of(from.width_px);
  rows_ = count_of(from.height_px);
  patches_.assign(size_t(columns_) * size_t(rows_), {});
  const int halves = coarse_from.width_px < from.width_px ? 2 : 1;
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const int x = patch_begin(column, from.width_px), y = patch_begin(row, from.height_px);
      const int coarse_row = std::min((y / halves + kPatchStep_px / 2) / kPatchStep_px, coarse_rows_ - 1);
      const int coarse_column = std::min((x / halves + kPatchStep_px / 2) / kPatchStep_px, coarse_columns_ - 1);
      const Displacement& coarse = coarse_[size_t(coarse_row * coarse_columns_ + coarse_column)];
      const Displacement candidates[] = {{0, 0}, {float(halves) * coarse.dx, float(halves) * coarse.dy}};
      search_patch(from, to, x, y, candidates, 2, false, patches_[size_t(row * columns_ + column)]);
    }
  }
  compare_brightness(from, to);
  unexplained_.resize(patches_.size());
  for (size_t i = 0; i < patches_.size(); ++i) {
    const float brighter = std::max(std::abs(brightness_[i]) - kBrightnessNoise, 0.0f);
    const float left = patches_[i].moved + brighter * brighter;
    unexplained_[i] = left / (left + kContrastPart * patches_[i].contrast + kNoise);
  }
  find_camera_motion();
  leave_out_what_came_into_view();
  for (size_t i = 0; i < patches_.size(); ++i) {
    unexplained_fraction_ += unexplained_[i] > 0.5f ? 1.0f : 0.0f;
    const int column = int(i) % columns_, row = int(i) / columns_;
    const float detail = detail_at(from, patch_begin(column, from.width_px), patch_begin(row, from.height_px));
    flat_fraction_ += detail < kFlatDetail ? 1.0f : 0.0f;
  }
  unexplained_fraction_ /= float(patches_.size());
  flat_fraction_ /= float(patches_.size());
}

}  // namespace maq
