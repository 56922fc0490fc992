#include "sources/synthetic/depth_noise.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "sources/synthetic/dice.h"

namespace maq {
namespace {

constexpr double kBaselineM = 0.05, kDisparityErrorPx = 0.08, kStepsOfAPixel = 16, kJumpPx = 1;
constexpr int kFatteningPx = 2;
constexpr double kMinDisparityPx = 0.5;

constexpr double kMinErrorM = 0.001, kErrorOfSquareM = 0.0005;  // metres, and metres for each square metre of range
constexpr double kJump = 0.05;                                  // share of the nearer depth
constexpr double kHoleFraction = 0.15, kMixedFraction = 0.6, kMaxMixture = 0.5;
constexpr double kRangeM = 6;

}  // namespace

DepthNoise::DepthNoise(const std::string& name, uint64_t seed) : kind_(Kind::kNone), seed_(seed) {
  if (name == "stereo") {
    kind_ = Kind::kStereo;
  } else if (name == "tof") {
    kind_ = Kind::kTimeOfFlight;
  } else if (name != "none") {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "noise=", name, " is not known; there are none, stereo and tof.");
  }
}

double DepthNoise::uniform(size_t pixel, uint64_t use) const {
  return double(mixed_bits(frame_seed_ + (use << 32) + pixel) >> 11) / 9007199254740992.0;
}

// The sum of four numbers of 16 bits each, which are all of one draw.
double DepthNoise::normal(size_t pixel) const {
  const uint64_t bits = mixed_bits(frame_seed_ + pixel);
  const double sum = double((bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48)) / 65536;
  return (sum - 2) * 1.7320508075688772;
}

void DepthNoise::apply(const SolidsPicture& picture, uint64_t frame, float* metres) {
  if (kind_ == Kind::kNone) return;
  frame_seed_ = mixed_bits(mixed_bits(seed_ + 0x9e3779b97f4a7c15u) + frame);
  before_.assign(metres, metres + size_t(picture.width_px) * size_t(picture.height_px));
  if (kind_ == Kind::kStereo) {
    see_by_stereo(picture, metres);
  } else {
    see_by_light(picture, metres);
  }
}

void DepthNoise::see_by_stereo(const SolidsPicture& picture, float* metres) {
  const int width = picture.width_px, height = picture.height_px;
  const double scale = picture.focal_px() * kBaselineM;
  errors_.resize(before_.size());
  for (size_t pixel = 0; pixel < before_.size(); ++pixel) {
    before_[pixel] = before_[pixel] > 0 ? float(scale / double(before_[pixel])) : 0;  // disparities from here on
    errors_[pixel] = float(normal(pixel));
  }
  for (int y = 0; y < height; ++y) {
    // In the other camera, to the right, the leftmost column that a pixel farther right is at: pixels right of it are
    // covered there.
    double covered_from = width;
    for (int x = width - 1; x >= 0; --x) {
      const size_t pixel = size_t(y) * size_t(width) + size_t(x);
      double disparity = before_[pixel], nearest = disparity, error = 0;
      for (int j = -kFatteningPx; j <= kFatteningPx; ++j) {
        for (int i = -kFatteningPx; i <= kFatteningPx; ++i) {
          if (x + i < 0 || x + i >= width || y + j < 0 || y + j >= height) continue;
          const size_t beside = pixel + size_t(j * width + i);
          nearest = std::max(nearest, double(before_[beside]));
          // Matching windows overlap, so neighbours err alike.
          if (std::abs(i) <= 1 && std::abs(j) <= 1) error += double(errors_[beside]) / 3;
        }
      }
      if (nearest > disparity + kJumpPx) disparity = nearest;
      const bool is_covered = x - disparity >= covered_from;
      covered_from = std::min(covered_from, x - disparity);
      disparity = std::floor((disparity + kDisparityErrorPx * error) * kStepsOfAPixel + 0.5) / kStepsOfAPixel;
      metres[pixel] = is_covered || disparity < kMinDisparityPx ? 0 : float(scale / disparity);
    }
  }
}

void DepthNoise::see_by_light(const SolidsPicture& picture, float* metres) {
  const int width = picture.width_px, height = picture.height_px;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t pixel = size_t(y) * size_t(width) + size_t(x);
      const double depth = before_[pixel];
      double other = depth;  // the neighbour's that differs most
      const auto look = [&](bool is_inside, ptrdiff_t to) {
        if (!is_inside) return;
        const double beside = before_[pixel + size_t(to)];
        if (beside > 0 && std::fabs(beside - depth) > std::fabs(other - depth)) other = beside;
      };
      look(x > 0, -1);
      look(x + 1 < width, 1);
      look(y > 0, -width);
      look(y + 1 < height, width);
      double seen = depth;
      if (std::fabs(other - depth) > kJump * std::min(other, depth)) {
        const double chance = uniform(pixel, 1);
        if (chance < kHoleFraction) {
          seen = 0;
        } else if (chance < kHoleFraction + kMixedFraction) {
          seen += kMaxMixture * uniform(pixel, 2) * (other - depth);
        }
      }
      const bool is_known = depth > 0 && seen > 0 && seen <= kRangeM;
      metres[pixel] = is_known ? float(seen + (kMinErrorM + kErrorOfSquareM * seen * seen) * normal(pixel)) : 0;
    }
  }
}

}  // namespace maq
