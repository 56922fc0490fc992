#include "prediction/health/camera_health.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace maq {
namespace {

// A checksum of bytes: a chain of multiplications, which no two frames of a camera share by chance.
uint64_t checksum_of(uint64_t sum, const uint8_t* bytes, size_t count) {
  constexpr uint64_t kFactor = 0x9E3779B97F4A7C15u;
  const auto add = [&](uint64_t word) {
    sum = (sum ^ word) * kFactor;
    sum ^= sum >> 32;
  };
  for (; count >= sizeof(uint64_t); bytes += sizeof(uint64_t), count -= sizeof(uint64_t)) {
    uint64_t word = 0;
    std::memcpy(&word, bytes, sizeof word);
    add(word);
  }
  uint64_t rest = count;
  for (size_t i = 0; i < count; ++i) rest = rest << 8 | bytes[i];
  add(rest);
  return sum;
}

uint64_t checksum_of(const ImageView& image) {
  uint64_t sum = 1;
  for (int plane = 0; plane < plane_count(image.format); ++plane) {
    const uint8_t* row = image.planes[plane].data;
    const size_t bytes = row_bytes(image.format, plane, image.width_px);
    for (int y = 0; y < plane_rows(image.format, plane, image.height_px);
         ++y, row += image.planes[plane].stride_bytes) {
      sum = checksum_of(sum, row, bytes);
    }
  }
  return sum;
}

PictureBrightness brightness_of(const LumaLevel& level) {
  float brightest = 0, sum = 0, squares = 0;
  for (int y = 0; y < level.height_px; ++y) {
    const float* const row = level.at(0, y);
    for (int x = 0; x < level.width_px; ++x) {
      brightest = std::max(brightest, row[x]);
      sum += row[x];
      squares += row[x] * row[x];
    }
  }
  const auto count = float(level.width_px * level.height_px);
  return {brightest, std::sqrt(std::max(squares / count - sum / count * (sum / count), 0.0f))};
}

}  // namespace

void CameraHealth::reset() {
  has_frame_ = false;
  rules_.reset();
}

bool CameraHealth::continues(const Frame& frame) const {
  if (!has_frame_ || frame.image.format != format_ || frame.image.width_px != width_px_ ||
      frame.image.height_px != height_px_ || frame.clock != clock_ || frame.timestamp_ns < timestamp_ns_) {
    return false;
  }
  // Both times may have any value.
  return uint64_t(frame.timestamp_ns) - uint64_t(timestamp_ns_) <= uint64_t(kMaxInterval_ns);
}

HealthResult CameraHealth::push(const Frame& frame) {
  luma_.set(frame.image, threads_);
  picture_.set(luma_);
  const bool is_continued = continues(frame);
  if (!is_continued) rules_.reset();
  match_.find(picture_, is_continued ? before_ : picture_);
  const uint64_t checksum = checksum_of(frame.image);
  const HealthResult result = rules_.add(picture_, before_, match_, is_continued && checksum == checksum_,
                                         brightness_of(picture_.fine()), frame.timestamp_ns);
  std::swap(picture_, before_);
  has_frame_ = true;
  format_ = frame.image.format;
  width_px_ = frame.image.width_px;
  height_px_ = frame.image.height_px;
  clock_ = frame.clock;
  timestamp_ns_ = frame.timestamp_ns;
  checksum_ = checksum;
  return result;
}

}  // namespace maq
