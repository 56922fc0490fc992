#include "edges/area_motion.h"

#include <cmath>
#include <cstddef>

namespace maq {
namespace {

constexpr int kMinKnown_px = 16;  // pixels of an area that both have, to tell what is motion there
constexpr double kTrim = 4;  // mean absolute differences, beyond which a pixel has jumped and tells nothing of the rest
// The share of squared differences that a plane explains: of noise without relation 3 in 1,024; of that of stereo, of
// which 7 x 7 pixels share one error, about 1 in 9.
constexpr double kMotion = 0.4;
constexpr float kJumpDifferences = 5;  // mean absolute differences: 4 standard deviations

// Differences between both frames over pixels of an area.
struct Sums {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0, d = 0, dx = 0, dy = 0, dd = 0, size = 0;

  void add(double at_x, double at_y, double difference) {
    n += 1;
    x += at_x;
    y += at_y;
    xx += at_x * at_x;
    xy += at_x * at_y;
    yy += at_y * at_y;
    d += difference;
    dx += difference * at_x;
    dy += difference * at_y;
    dd += difference * difference;
    size += std::abs(difference);
  }

  // The sum of squares that a plane explains.
  double explained() const {
    const double cxx = xx - x * x / n, cxy = xy - x * y / n, cyy = yy - y * y / n;
    const double cxd = dx - x * d / n, cyd = dy - y * d / n;
    const double determinant = cxx * cyy - cxy * cxy;
    double sum = d * d / n;
    if (determinant > 1e-9 * cxx * cyy) {
      sum += (cyy * cxd * cxd - 2 * cxy * cxd * cyd + cxx * cyd * cyd) / determinant;
    }
    return sum;
  }
};

}  // namespace

AreaMotion motion_of(const float* metres, const float* inverse, int width_px, const PixelArea& area) {
  // Two rounds, the second without what jumped.
  Sums sums;
  double limit = HUGE_VAL;
  for (int round = 0; round < 2; ++round) {
    sums = {};
    for (int y = area.top; y < area.bottom; ++y) {
      for (int x = area.left; x < area.right; ++x) {
        const size_t at = size_t(y) * size_t(width_px) + size_t(x);
        if (!(metres[at] > 0) || !(inverse[at] > 0)) continue;
        const double difference = double(1 / metres[at]) - double(inverse[at]);
        if (std::abs(difference) <= limit) sums.add(x - area.left, y - area.top, difference);
      }
    }
    limit = sums.n > 0 ? kTrim * sums.size / sums.n : 0;
  }
  AreaMotion found;
  if (sums.n == 0) return found;
  const double explained = sums.explained();
  // Of too few pixels nothing tells that they rest.
  found.moved = sums.n < kMinKnown_px || explained > kMotion * sums.dd;
  found.shift = std::sqrt(explained / sums.n);
  found.jump = kJumpDifferences * float(sums.size / sums.n);
  return found;
}

}  // namespace maq
