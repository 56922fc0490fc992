#include "prediction/transformer/motion_codes.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace maq {

MotionCodes::MotionCodes(std::shared_ptr<FrameEncoder> encoder)
    : encoder_(std::move(encoder)), predictor_({PredictionMethod::kMotion, 1}), codes_(encoder_->codes().count()) {}

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

const uint16_t* MotionCodes::at(int64_t target_ns, const uint16_t* newest) {
  if (frames_ < 2) return nullptr;
  predictor_.predict(target_ns - newest_ns_, moved_);
  if (predictor_.stats().method == PredictionMethod::kLast) return newest;
  encoder_->encode(moved_.image, codes_.data());
  return codes_.data();
}

}  // namespace maq
