#include "edges/measuring/face_sides.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr int kReachPx = 24;       // pixels of the grid beyond a face in which what is next to it is looked for
constexpr int kUnlabelledPx = 5;   // pixels of the grid without a region that are passed on the way
constexpr int kGapPx = 3;          // of unknown depth, of the grid
constexpr double kContactR = 2.5;  // footprints between a border and the plane that it touches
constexpr int kMixedPx = 6;        // pixels between both sides of a jump in depth that may be of neither
constexpr int kMaxWideningPx = 4;
constexpr float kMinWideningR = 1;
constexpr double kMaxContactCosine = 0.3, kMinFall = 0.6;
constexpr double kBandR = 8, kBandFraction = 0.05;  // half-width of the band in which a side lies
constexpr int kBins = 24;                           // parts of a side
constexpr double kMinSeen = 0.35;
constexpr int kMinSamples = 5;
constexpr double kMaxScatterR = 2.5;
constexpr double kMaxSagR = 1, kMaxSagFraction = 0.04, kMaxSideSag = 2.5;  // by which a straight side may seem to bend
constexpr double kEndSigmaR = 0.1, kScatterSigma = 0.6, kGapSigmaR = 0.3, kWideSigmaR = 0.5;
constexpr double kPlaneSigma = 0.6;
constexpr double kMaxTilt = 0.14;  // sine of the angle between a touched plane and a side's direction

double signed_distance(const Plane& plane, Vec3 point) { return dot(plane.normal, point) - plane.offset_m; }

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// By how many pixels the sensor shows a face too wide at a jump in depth, as matching of windows does: the network puts
// the edge where its distance is least.
template <class IsFace>
int widening(const EdgeField& field, int u, int v, int du, int dv, const IsFace& is_face) {
  const auto distance = [&](int t) {
    return field.distance_r[size_t(v - t * dv) * size_t(field.width) + size_t(u - t * du)];
  };
  int least = 0;
  for (int t = 1; t <= kMaxWideningPx && is_face(u - t * du, v - t * dv); ++t) {
    if (distance(t) < distance(least)) least = t;
  }
  return distance(0) - distance(least) >= kMinWideningR ? least : 0;
}

}  // namespace

double plane_sigma(const PlaneRegions& regions, int region, double focal_px) {
  const PlaneRegion& face = regions.regions()[size_t(region)];
  return kEndSigmaR * face.centre.z / focal_px + kPlaneSigma * face.rms_m;
}

double spacing_on(const Plane& plane, Vec3 point, double focal_px) {
  const double slant = std::abs(dot(plane.normal, normalized(point)));
  return point.z / focal_px / std::max(slant, 0.15);
}

void FaceBorder::find(const EdgeField& field, const PlaneRegions& regions, int region,
                      std::vector<BorderSample>& samples) {
  samples.clear();
  const PlaneRegion& face = regions.regions()[size_t(region)];
  const int step = regions.step(), label = region + 1;
  const Intrinsics& camera = field.intrinsics;
  const int left = std::max(0, face.left * step - step), top = std::max(0, face.top * step - step);
  const int right = std::min(field.width - 1, (face.right + 2) * step);
  const int bottom = std::min(field.height - 1, (face.bottom + 2) * step);
  const int width = right - left + 1, height = bottom - top + 1;
  const auto depth_at = [&](int u, int v) { return field.depth_m[size_t(v) * size_t(field.width) + size_t(u)]; };
  const auto x_of = [&](double u) { return (u - camera.cx_px) / camera.fx_px; };
  const auto y_of = [&](double v) { return (v - camera.cy_px) / camera.fy_px; };
  const auto label_at = [&](int u, int v) {
    return regions.label(std::min(u / step, regions.width() - 1), std::min(v / step, regions.height() - 1));
  };
  // Inverse depth beyond that of the plane; positive: nearer.
  const auto nearer = [&](int u, int v, double w) { return w - face.inverse.at(x_of(u), y_of(v)); };
  mask_.assign(size_t(width) * size_t(height), 0);
  for (int v = top; v <= bottom; ++v) {
    for (int u = left; u <= right; ++u) {
      const float depth = depth_at(u, v);
      if (!(depth > 1e-3f && depth < 1e3f)) continue;
      bool is_near = label_at(u, v) == label;
      if (!is_near && step > 1) {  // a pixel that the grid passes over
        for (int k = 0; k < 4 && !is_near; ++k) {
          const int to_u = u + (k == 0 ? -1 : k == 1 ? 1 : 0) * step, to_v = v + (k == 2 ? -1 : k == 3 ? 1 : 0) * step;
          is_near =
              to_u >= 0 && to_v >= 0 && to_u < field.width && to_v < field.height && label_at(to_u, to_v) == label;
        }
        const int own =
            label_at(u, v);  // of the pixel of the grid beside it, which may lie on the other side of an edge
        if (is_near && own != 0) {
          const double w = 1 / double(depth);
          const InversePlane& other = regions.regions()[size_t(own - 1)].inverse;
          is_near = std::abs(nearer(u, v, w)) < std::abs(w - other.at(x_of(u), y_of(v)));
        }
      }
      if (!is_near) continue;
      const double w = 1 / double(depth);
      if (std::abs(nearer(u, v, w)) <= face.slack * regions.tolerance(w))
        mask_[size_t((v - top) * width + u - left)] = 1;
    }
  }
  const auto is_face = [&](int u, int v) {
    return u >= left && u <= right && v >= top && v <= bottom && mask_[size_t((v - top) * width + u - left)] != 0;
  };
  const auto point_at = [&](double u, double v) {
    const double x = x_of(u), y = y_of(v), depth = 1 / face.inverse.at(x, y);
    return Vec3{x * depth, y * depth, depth};
  };
  const double focal = focal_px(camera);
  constexpr int kDirections[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (int v = top; v <= bottom; ++v) {
    for (int u = left; u <= right; ++u) {
      if (!is_face(u, v)) continue;
      for (const auto& [du, dv] : kDirections) {
        if (is_face(u + du, v + dv)) continue;
        BorderSample sample;
        int unknown = 0, unlabelled = 0, beyond = 0, at = 0;  // the pixel beyond the border, and its region
        bool returns = false;
        double off = 0;
        for (int t = 1; t <= kReachPx * step; ++t) {
          const int to_u = u + t * du, to_v = v + t * dv;
          if (to_u < 0 || to_v < 0 || to_u >= field.width || to_v >= field.height) break;
          returns = is_face(to_u, to_v);
          if (returns) break;
          const float depth = depth_at(to_u, to_v);
          if (!(depth > 1e-3f && depth < 1e3f)) {
            ++unknown;
            continue;
          }
          const double w = 1 / double(depth), here = nearer(to_u, to_v, w);
          const bool is_coplanar = std::abs(here) <= face.slack * regions.tolerance(w);
          const int there = label_at(to_u, to_v);
          returns = there == label && is_coplanar;
          if (returns) break;
          if (there != 0 && there != label) {
            beyond = there, at = t, off = here;
            break;
          }
          if (!is_coplanar) at = t, off = here;
          if (++unlabelled > kUnlabelledPx * step) break;
        }
        if (returns) continue;
        int last = at;  // the pixel of what is beyond that is nearest to the face
        while (beyond != 0 && last > 1) {
          const float depth = depth_at(u + (last - 1) * du, v + (last - 1) * dv);
          if (!(depth > 1e-3f && depth < 1e3f)) break;
          const double w = 1 / double(depth);
          const InversePlane& other = regions.regions()[size_t(beyond - 1)].inverse;
          if (std::abs(w - other.at(x_of(u + (last - 1) * du), y_of(v + (last - 1) * dv))) >
              regions.regions()[size_t(beyond - 1)].slack * regions.tolerance(w))
            break;
          --last;
        }
        sample.is_across_gap = unknown > kGapPx * step;
        const double half = beyond != 0 && last <= kMixedPx ? 0.5 * last : 0.5;
        const int wide =
            beyond != 0 && at > 0 && !field.distance_r.empty() ? widening(field, u, v, du, dv, is_face) : 0;
        sample.point = point_at(u + (half - wide) * du, v + (half - wide) * dv);
        sample.widening_px = uint8_t(wide);
        sample.outward = normalized(point_at(u + du, v + dv) - point_at(u, v));
        sample.beyond = uint8_t(beyond);
        if (!(sample.point.z > 0) || !is_finite(sample.point)) continue;
        if (at > 0) {
          const double z = sample.point.z, touch = 3 * regions.error().at(z) + kContactR * z / focal;
          const Plane* other = beyond != 0 ? &regions.regions()[size_t(beyond - 1)].plane : nullptr;
          const bool touches =
              other != nullptr && !sample.is_across_gap && std::abs(signed_distance(*other, sample.point)) <= touch;
          if (touches) {
            if (std::abs(dot(other->normal, face.plane.normal)) < kMaxContactCosine)
              sample.kind = BorderSample::Kind::kContact;
          } else if (off < 0) {
            // A round body turns away slowly.
            const double x = x_of(u + at * du), y = y_of(v + at * dv), depth = 1 / (face.inverse.at(x, y) + off);
            const double behind = -signed_distance(face.plane, {x * depth, y * depth, depth}) - regions.error().at(z);
            const double beside = length(point_at(u + at * du, v + at * dv) - sample.point);
            if (behind > kMinFall * beside) sample.kind = BorderSample::Kind::kFree;
          }
        }
        samples.push_back(sample);
      }
    }
  }
}

std::array<double, 2> FaceExtent::of(const PlaneRegions& regions, int region, Vec3 axis) {
  const PlaneRegion& face = regions.regions()[size_t(region)];
  positions_.clear();
  const int stride = 1 + face.pixels() / 6000;  // in rows
  for (int row = face.top; row <= face.bottom; row += stride) {
    for (int column = face.left; column <= face.right; ++column) {
      if (regions.label(column, row) != region + 1) continue;
      const double x = double(regions.ray_x(column)), y = double(regions.ray_y(row));
      const double depth = 1 / face.inverse.at(x, y);
      positions_.push_back(depth * (axis.x * x + axis.y * y + axis.z));
    }
  }
  if (positions_.empty()) return {0, 0};
  const ptrdiff_t cut = ptrdiff_t(positions_.size() / 200);
  std::nth_element(positions_.begin(), positions_.begin() + cut, positions_.end());
  const double low = positions_[size_t(cut)];
  std::nth_element(positions_.begin(), positions_.end() - 1 - cut, positions_.end());
  return {low, positions_[positions_.size() - 1 - size_t(cut)]};
}

FaceSide SideFinder::find(const PlaneRegions& regions, int region, const std::vector<BorderSample>& samples, Vec3 along,
                          Vec3 across, int sign, const std::array<double, 2>& extent,
                          const std::array<double, 2>& extent_across, double focal_px) {
  FaceSide side;
  const PlaneRegion& face = regions.regions()[size_t(region)];
  const double spacing = spacing_on(face.plane, face.centre, focal_px), length = extent_across[1] - extent_across[0];
  const double expected = sign > 0 ? extent[1] : extent[0];
  const double band = std::max(kBandR * spacing, kBandFraction * (extent[1] - extent[0]));
  if (!(length > 0)) return side;
  positions_.clear(), used_.clear();
  for (const BorderSample& sample : samples) {
    if (sample.kind == BorderSample::Kind::kUnknown || sign * dot(sample.outward, along) < 0.4) continue;
    const double position = dot(sample.point, along), beside = dot(sample.point, across);
    if (std::abs(position - expected) > band) continue;
    const double t = (beside - extent_across[0]) / length;
    if (t < 0.04 || t > 0.96) continue;
    positions_.push_back(position), used_.push_back(&sample);
  }
  if (positions_.size() < kMinSamples) return side;
  sorted_ = positions_;
  const double middle = median_of(sorted_);
  for (size_t i = 0; i < sorted_.size(); ++i) sorted_[i] = std::abs(positions_[i] - middle);
  const double scatter = 1.48 * median_of(sorted_);
  if (scatter > kMaxScatterR * spacing + 2 * regions.error().at(face.centre.z)) return side;
  // A round outline falls back towards both ends.
  double parts[2] = {}, counts[2] = {};
  for (size_t i = 0; i < positions_.size(); ++i) {
    const double t = (dot(used_[i]->point, across) - extent_across[0]) / length;
    const size_t part = std::abs(t - 0.5) > 1.0 / 6 ? 1 : 0;
    parts[part] += sign * positions_[i], counts[part] += 1;
  }
  const double sag = counts[0] > 0 && counts[1] > 0 ? parts[0] / counts[0] - parts[1] / counts[1] : 0;
  side.sag = sag / std::max(kMaxSagR * spacing + 0.5 * regions.error().at(face.centre.z), kMaxSagFraction * length);
  if (side.sag > kMaxSideSag) return side;
  const double limit = 2.5 * scatter + 0.7 * spacing;
  double sum = 0, squares = 0, count = 0, gaps = 0, wide = 0;
  uint32_t bins = 0;
  std::array<int, 256> votes{};
  for (size_t i = 0; i < positions_.size(); ++i) {
    if (std::abs(positions_[i] - middle) > limit) continue;
    sum += positions_[i] - middle, squares += (positions_[i] - middle) * (positions_[i] - middle), count += 1;
    gaps += used_[i]->is_across_gap, wide += used_[i]->widening_px;
    const double t = (dot(used_[i]->point, across) - extent_across[0]) / length;
    bins |= 1u << std::clamp(int(t * kBins), 0, kBins - 1);
    if (used_[i]->kind == BorderSample::Kind::kContact) ++votes[used_[i]->beyond];
  }
  for (int k = 0; k < kBins; ++k) side.seen += (bins >> k & 1) / double(kBins);
  if (side.seen < kMinSeen || count < kMinSamples) return side;
  side.is_known = true;
  side.position_m = middle + sum / count;
  const double deviation = std::sqrt(std::max(0.0, squares / count - (sum / count) * (sum / count)));
  // Neighbouring samples err alike: the scatter does not shrink with their number.
  side.sigma_m =
      kEndSigmaR * spacing + kScatterSigma * deviation + (kGapSigmaR * gaps + kWideSigmaR * wide) / count * spacing;
  // The plane that is touched says where the side is better than the border's pixels do.
  const size_t touched = size_t(std::max_element(votes.begin(), votes.end()) - votes.begin());
  if (votes[touched] > 0.5 * count) {
    const Plane& other = regions.regions()[touched - 1].plane;
    const double slope = dot(other.normal, along);
    if (std::abs(slope) > std::sqrt(1 - kMaxTilt * kMaxTilt)) {
      const double beside = 0.5 * (extent_across[0] + extent_across[1]);
      const Vec3 at = face.centre + (side.position_m - dot(face.centre, along)) * along +
                      (beside - dot(face.centre, across)) * across;
      const double shift = -signed_distance(other, at) / slope;
      if (std::abs(shift) <= 3 * spacing + 3 * regions.error().at(at.z)) {
        side.position_m += shift;
        side.sigma_m = plane_sigma(regions, int(touched) - 1, focal_px);
      }
    }
  }
  return side;
}

}  // namespace maq
