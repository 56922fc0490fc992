#include "prediction/transformer/motion_codes.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace maq {

MotionCodes::MotionCodes(std::shared_ptr<FrameEncoder> encoder)
    : encoder_(std::move(encoder)), predictor_({MAQ_PREDICTION_MOTION, 1}), codes_(encoder_->codes().count()) {}

void MotionCodes::reset() {
  predictor_.reset();
  frames_ = 0;
}

void MotionCodes::add(const uint8_t* rgb, int64_t time_ns) {
  const int side_px = encoder_->frame_px();
  seen_.clear();
  std::memcpy(seen_.allocate(MAQ_PIXEL_RGB8, side_px, side_px), rgb, size_t(side_px) * size_t(side_px) * 3);
  seen_.timestamp_ns = newest_ns_ = time_ns;
  predictor_.push(seen_);
  frames_ = std::min<size_t>(frames_ + 1, 2);
}

const uint8_t* MotionCodes::picture(int64_t coming_ns) {
  if (frames_ < 2) return nullptr;
  predictor_.predict(coming_ns - newest_ns_, moved_);
  return moved_.storage.data();
}

const uint16_t* MotionCodes::at(int64_t coming_ns, const uint16_t* newest) {
  if (picture(coming_ns) == nullptr) return nullptr;
  if (predictor_.stats().method == MAQ_PREDICTION_LAST) return newest;
  encoder_->run(moved_.image, codes_.data());
  return codes_.data();
}

}  // namespace maq
