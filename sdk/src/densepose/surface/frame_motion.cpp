#include "densepose/surface/frame_motion.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace maq {
namespace {

constexpr int kLongSide = 320;   // of the fine level, at most; the coarse level has half of it
constexpr int kMotionBlock = 8;  // side of a block, in pixels of the fine level
// Half of the side of the window around a block's middle that is compared, and how far it is looked for, at each level.
constexpr int kFineHalf = 8, kFineReach = 1, kCoarseHalf = 4, kCoarseReach = 6;
// A block has moved if that fits better than rest by so much a pixel: noise moves nothing.
constexpr int kMinGain = 1;
constexpr int kOutside = 1 << 24;  // more than any difference

// The bytes that tell the brightness of pixels: Y, the grey value or green. No first byte: a depth image.
struct Bright {
  const uint8_t* first;
  size_t stride, step;
};

Bright brightness_of(const ImageView& image) {
  const PlaneView& plane = image.planes[0];
  const auto bytes = [&](size_t first, size_t step) { return Bright{plane.data + first, plane.stride_bytes, step}; };
  switch (image.format) {
    case MAQ_PIXEL_RGB8:
    case MAQ_PIXEL_BGR8: return bytes(1, 3);
    case MAQ_PIXEL_RGBA8: return bytes(1, 4);
    case MAQ_PIXEL_YUYV: return bytes(0, 2);
    case MAQ_PIXEL_NV12:
    case MAQ_PIXEL_GREY8: return bytes(0, 1);
    default: return {nullptr, 0, 0};
  }
}

uint8_t mean(int a, int b, int c, int d) { return uint8_t((a + b + c + d + 2) / 4); }

// The sum of absolute differences of two windows of 2 kHalf pixels each way, given by their middles. Ends early when it
// is not less than `enough`. Four rows are copied side by side because compilers then take the processor's instruction
// for such sums, also for rows of 8 bytes.
template <int kHalf>
int difference(const uint8_t* a, const uint8_t* b, int stride, int enough) {
  constexpr int kSide = 2 * kHalf, kRows = 4;
  const ptrdiff_t corner = ptrdiff_t(kHalf) * stride + kHalf;
  a -= corner;
  b -= corner;
  int sum = 0;
  for (int y = 0; y < kSide && sum < enough; y += kRows) {
    uint8_t p[kRows * kSide], q[kRows * kSide];
    for (int row = 0; row < kRows; ++row, a += stride, b += stride) {
      std::memcpy(p + row * kSide, a, kSide);
      std::memcpy(q + row * kSide, b, kSide);
    }
    for (int i = 0; i < kRows * kSide; ++i) sum += std::abs(int(p[i]) - int(q[i]));
  }
  return sum;
}

// Where between -0.5 and 0.5 the parabola through three values has its minimum; 0 without any.
float minimum_between(int before, int middle, int after) {
  const int curve = before - 2 * middle + after;
  return curve > 0 ? std::clamp(0.5f * float(before - after) / float(curve), -0.5f, 0.5f) : 0.0f;
}

}  // namespace

// A window of one level, as near to a place as it fits, against the frame before.
template <int kHalf>
class FrameMotion::Window {
 public:
  static constexpr int kPixels = 4 * kHalf * kHalf;

  Window(const Level& now, const Level& before, int middle_x, int middle_y)
      : now_(now),
        before_(before),
        x_(std::clamp(middle_x, kHalf, now.width - kHalf)),
        y_(std::clamp(middle_y, kHalf, now.height - kHalf)) {}

  // From where it would have come by that motion, or a number that is not less than `enough`; kOutside if it was not in
  // the frame.
  int difference_by(int dx, int dy, int enough = kOutside) const {
    const int from_x = x_ - dx, from_y = y_ - dy;
    if (from_x < kHalf || from_y < kHalf || from_x > before_.width - kHalf || from_y > before_.height - kHalf)
      return kOutside;
    return difference<kHalf>(now_.values.data() + ptrdiff_t(y_) * now_.width + x_,
                             before_.values.data() + ptrdiff_t(from_y) * before_.width + from_x, now_.width, enough);
  }

  // The best motion within `reach` of `around`, if it is clearly better than rest: ring after ring, as most motions are
  // small and a good one soon ends the sums of others.
  Vector best(Vector around, int reach) const {
    Vector best_motion;
    int lowest = difference_by(0, 0) - kMinGain * kPixels;
    for (int ring = 0; ring <= reach; ++ring) {
      for (int dy = -ring; dy <= ring; ++dy) {
        const int step = ring == 0 || std::abs(dy) == ring ? 1 : 2 * ring;
        for (int dx = -ring; dx <= ring; dx += step) {
          if (lowest <= 0) return best_motion;
          const int sum = difference_by(around.x + dx, around.y + dy, lowest);
          if (sum < lowest) lowest = sum, best_motion = {around.x + dx, around.y + dy};
        }
      }
    }
    return best_motion;
  }

 private:
  const Level &now_, &before_;
  int x_, y_;
};

void FrameMotion::next(const ImageView& image, bool follows_last) {
  const Bright bright = brightness_of(image);
  const bool is_same_size = image.width_px == image_width_px_ && image.height_px == image_height_px_;
  image_width_px_ = image.width_px;
  image_height_px_ = image.height_px;
  step_ = std::max(1, (std::max(image.width_px, image.height_px) + kLongSide - 1) / kLongSide);
  std::swap(now_, before_);

  Level& fine = now_.fine;
  const bool is_depth = bright.first == nullptr;
  fine.width = is_depth ? 0 : image.width_px / step_ / 2 * 2;
  fine.height = is_depth ? 0 : image.height_px / step_ / 2 * 2;
  fine.values.resize(size_t(fine.width) * size_t(fine.height));
  const size_t right = size_t(step_ / 2) * bright.step, down = size_t(step_ / 2) * bright.stride;
  for (int y = 0; y < fine.height; ++y) {
    const uint8_t* at = bright.first + size_t(y * step_) * bright.stride;
    uint8_t* const out = fine.values.data() + size_t(y) * size_t(fine.width);
    for (int x = 0; x < fine.width; ++x, at += size_t(step_) * bright.step)
      out[x] = mean(at[0], at[right], at[down], at[down + right]);
  }
  Level& coarse = now_.coarse;
  coarse.width = fine.width / 2;
  coarse.height = fine.height / 2;
  coarse.values.resize(size_t(coarse.width) * size_t(coarse.height));
  for (int y = 0; y < coarse.height; ++y) {
    const uint8_t* const upper = fine.values.data() + size_t(2 * y) * size_t(fine.width);
    const uint8_t* const lower = upper + fine.width;
    uint8_t* const out = coarse.values.data() + size_t(y) * size_t(coarse.width);
    for (int x = 0; x < coarse.width; ++x)
      out[x] = mean(upper[2 * x], upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]);
  }

  is_known_ = follows_last && is_same_size && before_.fine.values.size() == fine.values.size() &&
              std::min(fine.width, fine.height) >= 2 * kFineHalf;
  columns_ = (fine.width + kMotionBlock - 1) / kMotionBlock;
  rows_ = (fine.height + kMotionBlock - 1) / kMotionBlock;
  blocks_.resize(size_t(columns_) * size_t(rows_));
  is_matched_.assign(blocks_.size(), 0);
}

const FrameMotion::Motion& FrameMotion::at(const Point& point) {
  const auto block = [&](double px, int count) {
    return int(std::clamp(px / (step_ * kMotionBlock), 0.0, double(count - 1)));
  };
  const int column = block(point.x, columns_), row = block(point.y, rows_);
  const size_t index = size_t(row) * size_t(columns_) + size_t(column);
  if (is_matched_[index] == 0) {
    blocks_[index] = matched(column, row);
    is_matched_[index] = 1;
  }
  return blocks_[index];
}

FrameMotion::Motion FrameMotion::matched(int column, int row) const {
  const int x = column * kMotionBlock + kMotionBlock / 2, y = row * kMotionBlock + kMotionBlock / 2;
  const Vector rough = Window<kCoarseHalf>(now_.coarse, before_.coarse, x / 2, y / 2).best({}, kCoarseReach);
  const Window<kFineHalf> fine(now_.fine, before_.fine, x, y);
  const Vector motion = fine.best({2 * rough.x, 2 * rough.y}, kFineReach);
  const int lowest = fine.difference_by(motion.x, motion.y);
  float rest_x = 0, rest_y = 0;
  if (motion.x != 0 || motion.y != 0) {
    const auto beside = [&](int dx, int dy) { return fine.difference_by(motion.x + dx, motion.y + dy); };
    rest_x = minimum_between(beside(-1, 0), lowest, beside(1, 0));
    rest_y = minimum_between(beside(0, -1), lowest, beside(0, 1));
  }
  return {(float(motion.x) + rest_x) * float(step_), (float(motion.y) + rest_y) * float(step_),
          float(lowest) / float(fine.kPixels)};
}

}  // namespace maq
