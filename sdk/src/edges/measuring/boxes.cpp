#include "edges/measuring/boxes.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr double kRightAngle = 0.12;  // cosine of the angle between two faces of a box
constexpr double kParallel = 0.996;   // cosine between a face and the plane that a box stands on
constexpr int kMinContacts = 5;       // pairs of pixels of the grid along the crease of two faces
constexpr size_t kMaxPairs = 48;      // those with the longest creases, in a cluttered frame
constexpr double kMinSideR = 4;       // footprints
constexpr int kRaster = 20;           // rows and columns of points on a face that are compared with depth
constexpr double kMaxThrough = 0.08;  // fraction of points of a box behind which something is seen
constexpr double kMaxThroughFace = 0.1, kMaxThroughSide = 0.2;  // of a face that was found, and of one that was not
constexpr double kMarginR = 1.5;                                // footprints at the rim of a face that are not compared
constexpr double kMinAgree = 0.5;                               // fraction of its points that depth agrees with
// Smaller faces, and those seen at a lower sine, are not compared one by one.
constexpr double kMinFacePx = 40, kMinSlant = 0.3;
constexpr double kSurrounded = 0.8, kMinSidePx = 60, kMinAgreeSides = 0.6;
constexpr double kMoreFaces = 0.1;   // by which each further face makes a box better
constexpr size_t kClaimPx = 4;       // pixels of a cell that a box claims
constexpr double kMaxClaimed = 0.3;  // fraction of a box that may lie where another is
// Faces that bend more, or whose outline does, belong to round things.
constexpr double kMaxRoundness = 0.06, kMaxMeanSag = 1;

// The rotation that is nearest to three directions with weights.
void orthonormalize(std::array<Vec3, 3>& axis) {
  for (int k = 0; k < 12; ++k) {
    const double volume = dot(axis[0], cross(axis[1], axis[2]));
    if (std::abs(volume) < 1e-12) return;
    const std::array<Vec3, 3> inverse{(1 / volume) * cross(axis[1], axis[2]), (1 / volume) * cross(axis[2], axis[0]),
                                      (1 / volume) * cross(axis[0], axis[1])};
    for (size_t i = 0; i < 3; ++i) axis[i] = 0.5 * (axis[i] + inverse[i]);
  }
  for (Vec3& a : axis) a = normalized(a);
}

}  // namespace

const std::vector<BorderSample>& BoxFinder::border_of(const EdgeField& field, int region) {
  if (!has_border_[size_t(region)]) border_.find(field, regions_, region, borders_[size_t(region)]);
  has_border_[size_t(region)] = 1;
  return borders_[size_t(region)];
}

// Convex pairs at right angles: both faces are seen from outside, and pixels of both lie at the crease.
void BoxFinder::find_pairs() {
  pairs_.clear();
  const std::vector<PlaneRegion>& all = regions_.regions();
  const size_t count = all.size();
  for (size_t a = 0; a < count; ++a) {
    for (size_t b = a + 1; b < count; ++b) {
      const int contacts = regions_.contacts(a, b);
      if (contacts < kMinContacts || std::abs(dot(all[a].plane.normal, all[b].plane.normal)) > kRightAngle) continue;
      const Vec3 between = all[b].centre - all[a].centre;
      if (dot(all[a].plane.normal, between) >= 0 || dot(all[b].plane.normal, between) <= 0) continue;
      pairs_.push_back({int(a), int(b), contacts});
    }
  }
  if (pairs_.size() <= kMaxPairs) return;
  std::sort(pairs_.begin(), pairs_.end(), [](const Pair& a, const Pair& b) {
    return a.contacts != b.contacts ? a.contacts > b.contacts : a.a != b.a ? a.a < b.a : a.b < b.b;
  });
  pairs_.resize(kMaxPairs);
}

void BoxFinder::consider(const EdgeField& field, std::array<int, 3> faces) {
  Candidate box;
  box.face = faces;
  if (!measure(field, box)) return;
  for (const int face : box.face) {
    if (face >= 0 && regions_.roundness(face) > kMaxRoundness) return;
  }
  candidates_.push_back(box);
}

// Returns the depth of its nearest face.
double BoxFinder::depth_of(const Candidate& box) const {
  double depth = INFINITY;
  for (const int face : box.face) {
    if (face >= 0) depth = std::min(depth, regions_.regions()[size_t(face)].centre.z);
  }
  return depth;
}

bool BoxFinder::measure(const EdgeField& field, Candidate& box) {
  const std::vector<PlaneRegion>& all = regions_.regions();
  int known = 0;
  for (size_t k = 0; k < 3; ++k) {
    if (box.face[k] < 0) continue;
    ++known;
    const PlaneRegion& face = all[size_t(box.face[k])];
    box.axis[k] = std::sqrt(double(face.pixels())) * face.plane.normal;
  }
  if (known == 1) {
    if (!stands_on_plane(field, box)) return false;
    const Vec3 normal = normalized(box.axis[0]);
    box.axis = {normal, any_orthogonal(normal), cross(normal, any_orthogonal(normal))};
    turn_to_sides(box);
  } else {
    if (known == 2) {
      const Vec3 third = cross(box.axis[0], box.axis[1]);
      box.axis[2] = std::sqrt(length(third)) * normalized(third);
    }
    // Weights must not differ too much for the iteration.
    double most = 0;
    for (const Vec3& a : box.axis) most = std::max(most, length(a));
    for (Vec3& a : box.axis) a = (std::max(0.1, length(a) / most)) * normalized(a);
    orthonormalize(box.axis);
  }
  if (!measure_sides(field, box)) return false;
  for (size_t k = 0; k < 3; ++k) {
    const double size = box.high[k] - box.low[k];
    if (!(size >= kMinSideR * depth_of(box) / focal_px(field.intrinsics))) return false;
  }
  return is_seen(field, box);
}

// A single face has the directions of its smallest rectangle.
void BoxFinder::turn_to_sides(Candidate& box) {
  const int face = box.face[0];
  const auto turned = [&](double angle) { return std::cos(angle) * box.axis[1] + std::sin(angle) * box.axis[2]; };
  double best = 0, least = INFINITY;
  const auto look = [&](double angle) {
    const auto one = extent_.of(regions_, face, turned(angle));
    const auto other = extent_.of(regions_, face, turned(angle + M_PI / 2));
    const double area = (one[1] - one[0]) * (other[1] - other[0]);
    if (area < least) least = area, best = angle;
  };
  constexpr int kSteps = 18;
  for (int k = 0; k < kSteps; ++k) look(k * M_PI / 2 / kSteps);
  double step = M_PI / 4 / kSteps;
  for (int k = 0; k < 5; ++k, step /= 2) {
    const double from = best;
    look(from - step), look(from + step);
  }
  box.axis[1] = turned(best);
  box.axis[2] = cross(box.axis[0], box.axis[1]);
}

bool BoxFinder::measure_sides(const EdgeField& field, Candidate& box) {
  const std::vector<PlaneRegion>& all = regions_.regions();
  const double focal = focal_px(field.intrinsics);
  struct End {
    FaceSide side[2];  // by both faces that may show it
    int count = 0;
  };
  std::array<std::array<End, 2>, 3> ends;  // by axis; low, high
  for (size_t j = 0; j < 3; ++j) {
    if (box.face[j] < 0) continue;
    const int region = box.face[j];
    const PlaneRegion& face = all[size_t(region)];
    box.high[j] = dot(box.axis[j], face.centre);
    box.high_sigma[j] = plane_sigma(regions_, region, focal);
    const size_t k = (j + 1) % 3, l = (j + 2) % 3;
    const std::vector<BorderSample>& samples = border_of(field, region);
    const auto extent_k = extent_.of(regions_, region, box.axis[k]),
               extent_l = extent_.of(regions_, region, box.axis[l]);
    double sag = 0, sides = 0;
    for (const int sign : {0, 1}) {
      const FaceSide a =
          side_.find(regions_, region, samples, box.axis[k], box.axis[l], 2 * sign - 1, extent_k, extent_l, focal);
      const FaceSide b =
          side_.find(regions_, region, samples, box.axis[l], box.axis[k], 2 * sign - 1, extent_l, extent_k, focal);
      if (a.is_known) ends[k][size_t(sign)].side[ends[k][size_t(sign)].count++] = a;
      if (b.is_known) ends[l][size_t(sign)].side[ends[l][size_t(sign)].count++] = b;
      for (const FaceSide& side : {a, b}) {
        if (side.is_known) sag += side.sag, sides += 1;
      }
    }
    if (sides >= 2 && sag > kMaxMeanSag * sides) return false;
  }
  const double spacing = depth_of(box) / focal;  // a footprint
  for (size_t k = 0; k < 3; ++k) {
    for (const int sign : {0, 1}) {
      End& end = ends[k][size_t(sign)];
      if (sign == 1 && box.face[k] >= 0) {  // the face itself; its neighbours must end there
        for (int i = 0; i < end.count; ++i) {
          const double limit = 3 * (end.side[i].sigma_m + box.high_sigma[k]) + 4 * spacing;
          if (std::abs(end.side[i].position_m - box.high[k]) > limit) return false;
        }
        continue;
      }
      if (end.count == 0) {
        if (sign == 0 && box.face[k] >= 0 && stands_on_plane(field, box)) continue;
        return false;
      }
      double position = end.side[0].position_m, sigma = end.side[0].sigma_m;
      if (end.count == 2) {
        const FaceSide &a = end.side[0], &b = end.side[1];
        const double apart = std::abs(a.position_m - b.position_m);
        if (apart > 3 * std::hypot(a.sigma_m, b.sigma_m) + 3 * spacing) {
          if (std::max(a.seen, b.seen) < 0.7 || std::min(a.seen, b.seen) > 0.5) return false;
          const FaceSide& better = a.seen > b.seen ? a : b;
          position = better.position_m, sigma = better.sigma_m;
        } else {
          const double weight_a = 1 / (a.sigma_m * a.sigma_m), weight_b = 1 / (b.sigma_m * b.sigma_m);
          position = (weight_a * a.position_m + weight_b * b.position_m) / (weight_a + weight_b);
          sigma = std::max(1 / std::sqrt(weight_a + weight_b), 0.3 * apart);
        }
      }
      (sign == 0 ? box.low : box.high)[k] = position;
      (sign == 0 ? box.low_sigma : box.high_sigma)[k] = sigma;
    }
  }
  return true;
}

bool BoxFinder::has_plane_behind(int region) const {
  const PlaneRegion& face = regions_.regions()[size_t(region)];
  return std::any_of(regions_.regions().begin(), regions_.regions().end(), [&](const PlaneRegion& other) {
    return dot(other.plane.normal, face.plane.normal) > kParallel &&
           dot(face.plane.normal, other.centre - face.centre) < 0 && other.pixels() > face.pixels();
  });
}

// A single face: the plane behind it that is seen beyond most of its border.
bool BoxFinder::stands_on_plane(const EdgeField& field, Candidate& box) {
  if (box.face[1] >= 0 || box.face[2] >= 0) return false;
  const std::vector<PlaneRegion>& all = regions_.regions();
  std::array<int, 256> votes{};
  int free = 0;
  const std::vector<BorderSample>& border = border_of(field, box.face[0]);
  for (const BorderSample& sample : border) {
    if (sample.kind != BorderSample::Kind::kFree) continue;
    ++free;
    ++votes[sample.beyond];
  }
  votes[0] = 0;
  const size_t most = size_t(std::max_element(votes.begin(), votes.end()) - votes.begin());
  if (votes[most] == 0 || votes[most] < 0.3 * free) return false;
  box.is_surrounded = votes[most] >= kSurrounded * double(border.size());
  const PlaneRegion &face = all[size_t(box.face[0])], &under = all[most - 1];
  const double slope = dot(under.plane.normal, normalized(box.axis[0]));
  if (slope < kParallel) return false;
  box.low[0] = box.high[0] + (under.plane.offset_m - dot(under.plane.normal, face.centre)) / slope;
  box.low_sigma[0] = plane_sigma(regions_, int(most) - 1, focal_px(field.intrinsics));
  return true;
}

// Calls visit(face, point, depth, pixel) for a raster of points on the faces towards the camera; depth is 0 where it is
// unknown or the point lies outside of the image. Returns false if a point is behind the camera.
template <class Visit>
bool BoxFinder::raster(const EdgeField& field, const Candidate& box, const SeenFaces& faces, Visit&& visit) {
  const Intrinsics& camera = field.intrinsics;
  for (size_t f = 0; f < faces.size(); ++f) {
    const SeenFace& face = faces[f];
    if (!face.is_seen) continue;
    const size_t a = (f + 1) % 3, b = (f + 2) % 3;
    const auto along = [&](size_t axis, int step) {
      const double size = box.high[axis] - box.low[axis], margin = std::min(kMarginR * face.footprint_m, 0.2 * size);
      return box.low[axis] + margin + (size - 2 * margin) * (step + 0.5) / kRaster;
    };
    for (int i = 0; i < kRaster; ++i) {
      for (int j = 0; j < kRaster; ++j) {
        const Vec3 point = face.position_m * box.axis[f] + along(a, i) * box.axis[a] + along(b, j) * box.axis[b];
        if (!(point.z > 0)) return false;
        const double u = std::floor(camera.fx_px * point.x / point.z + camera.cx_px + 0.5);
        const double v = std::floor(camera.fy_px * point.y / point.z + camera.cy_px + 0.5);
        const bool is_inside = u >= 0 && v >= 0 && u < field.width && v < field.height;
        const size_t pixel = is_inside ? size_t(v) * size_t(field.width) + size_t(u) : 0;
        const float depth = is_inside ? field.depth_m[pixel] : 0;
        visit(f, point, depth > 1e-3f && depth < 1e3f ? double(depth) : 0.0, pixel);
      }
    }
  }
  return true;
}

BoxFinder::SeenFaces BoxFinder::faces_to_camera(const Candidate& box, double focal) {
  SeenFaces faces;
  for (size_t k = 0; k < 3; ++k) {
    SeenFace& face = faces[k];
    face.is_seen = box.high[k] < 0 || box.low[k] > 0;
    face.position_m = box.high[k] < 0 ? box.high[k] : box.low[k];
    const size_t a = (k + 1) % 3, b = (k + 2) % 3;
    const Vec3 middle = face.position_m * box.axis[k] + 0.5 * (box.low[a] + box.high[a]) * box.axis[a] +
                        0.5 * (box.low[b] + box.high[b]) * box.axis[b];
    face.footprint_m = middle.z / focal;
    face.slant = std::abs(dot(box.axis[k], normalized(middle)));
    face.area_px =
        (box.high[a] - box.low[a]) * (box.high[b] - box.low[b]) * face.slant / (face.footprint_m * face.footprint_m);
  }
  return faces;
}

double BoxFinder::tolerance_at(const SeenFace& face, Vec3 point) const {
  return (3 * regions_.error().at(point.z) + 2.5 * face.footprint_m) / std::max(face.slant, 0.3);
}

// Compares the faces towards the camera with depth. Something behind them means that the box is not there.
bool BoxFinder::is_seen(const EdgeField& field, Candidate& box) const {
  const SeenFaces faces = faces_to_camera(box, focal_px(field.intrinsics));
  std::array<double, 3> agree{}, through{};
  const bool is_before = raster(field, box, faces, [&](size_t f, Vec3 point, double depth, size_t) {
    if (depth == 0) return;
    const double off = depth - point.z, tolerance = tolerance_at(faces[f], point);
    if (std::abs(off) <= tolerance) {
      agree[f] += 1;
    } else if (off > 0) {
      through[f] += 1;
    }
  });
  if (!is_before) return false;
  double agree_all = 0, through_all = 0, all = 0;
  constexpr double kPoints = kRaster * kRaster;
  for (size_t k = 0; k < 3; ++k) {
    if (!faces[k].is_seen) continue;
    const double most = box.face[k] >= 0 ? kMaxThroughFace : kMaxThroughSide;
    if (faces[k].slant >= kMinSlant && faces[k].area_px >= kMinFacePx && through[k] > most * (agree[k] + through[k]))
      return false;
    if (box.face[k] >= 0 && agree[k] < kMinAgree * kPoints) return false;
    const double weight = faces[k].area_px / kPoints;
    agree_all += weight * agree[k], through_all += weight * through[k], all += faces[k].area_px;
  }
  const auto count = std::count_if(box.face.begin(), box.face.end(), [](int face) { return face >= 0; });
  // The plane behind a single face may be far behind its box: one more face must be seen to reach it.
  if (count == 1 && !box.is_surrounded) {
    const double sides = all - faces[0].area_px, agree_sides = agree_all - agree[0] * faces[0].area_px / kPoints;
    if (sides < kMinSidePx || agree_sides < kMinAgreeSides * sides) return false;
  }
  box.score = (agree_all - 3 * through_all) * (1 + kMoreFaces * double(count));
  return through_all <= kMaxThrough * (agree_all + through_all) && agree_all >= kMinAgree * all;
}

// Whether most of a box is seen where a better one is seen already. If not, its pixels are its own from now on.
bool BoxFinder::is_claimed(const EdgeField& field, const Candidate& box) {
  const SeenFaces faces = faces_to_camera(box, focal_px(field.intrinsics));
  double mine = 0, taken = 0;
  for (const bool takes : {false, true}) {
    raster(field, box, faces, [&](size_t f, Vec3 point, double depth, size_t pixel) {
      if (depth == 0 || std::abs(depth - point.z) > tolerance_at(faces[f], point)) return;
      const size_t column = pixel % size_t(field.width) / kClaimPx, row = pixel / size_t(field.width) / kClaimPx;
      char& claim = claims_[row * (size_t(field.width) / kClaimPx + 1) + column];
      if (takes) {
        claim = 1;
      } else {
        mine += faces[f].area_px, taken += claim * faces[f].area_px;
      }
    });
    if (!takes && taken > kMaxClaimed * mine) return true;
  }
  return false;
}

void BoxFinder::find_candidates(const EdgeField& field) {
  candidates_.clear();
  find_pairs();
  const std::vector<PlaneRegion>& all = regions_.regions();
  const auto meets = [&](int a, int b) {
    return std::any_of(pairs_.begin(), pairs_.end(),
                       [&](const Pair& p) { return (p.a == a && p.b == b) || (p.a == b && p.b == a); });
  };
  for (size_t i = 0; i < pairs_.size(); ++i) {
    consider(field, {pairs_[i].a, pairs_[i].b, -1});
    for (size_t j = i + 1; j < pairs_.size(); ++j) {
      // Three faces: both pairs share one, and the other two are at right angles, too.
      const Pair &p = pairs_[i], &q = pairs_[j];
      const int shared = p.a == q.a || p.a == q.b ? p.a : p.b == q.a || p.b == q.b ? p.b : -1;
      if (shared < 0) continue;
      const int one = p.a + p.b - shared, other = q.a + q.b - shared;
      if (std::abs(dot(all[size_t(one)].plane.normal, all[size_t(other)].plane.normal)) > kRightAngle) continue;
      if (meets(one, other) && shared > std::min(one, other)) continue;  // found from two other pairs, too
      consider(field, {shared, one, other});
    }
  }
  for (size_t i = 0; i < all.size(); ++i) {
    if (has_plane_behind(int(i))) consider(field, {int(i), -1, -1});
  }
  std::sort(candidates_.begin(), candidates_.end(),
            [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
}

MeasuredBox BoxFinder::measured(const Candidate& box, double focal_tolerance) {
  std::array<size_t, 3> order{0, 1, 2};
  const auto size = [&](size_t k) { return box.high[k] - box.low[k]; };
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return size(a) > size(b); });
  MeasuredBox made;
  for (size_t i = 0; i < 3; ++i) {
    const size_t k = order[i];
    made.axis[i] = box.axis[k];
    made.size_m[i] = size(k);
    const double across = 1 - box.axis[k].z * box.axis[k].z;  // of the squared length
    made.size_tolerance_m[i] =
        std::hypot(2 * std::hypot(box.low_sigma[k], box.high_sigma[k]), size(k) * across * focal_tolerance);
    made.centre = made.centre + 0.5 * (box.low[k] + box.high[k]) * box.axis[k];
  }
  const auto faces = std::count_if(box.face.begin(), box.face.end(), [](int face) { return face >= 0; });
  made.corners = faces == 1 ? 4 : faces == 2 ? 6 : 7;
  return made;
}

void BoxFinder::find(const EdgeField& field, std::vector<MeasuredBox>& found, double focal_tolerance) {
  found.clear();
  regions_.find(field);
  const size_t count = regions_.regions().size();
  if (borders_.size() < count) borders_.resize(count);
  has_border_.assign(count, 0);
  find_candidates(field);
  is_taken_.assign(count, 0);
  claims_.assign((size_t(field.width) / kClaimPx + 1) * (size_t(field.height) / kClaimPx + 1), 0);
  for (const Candidate& box : candidates_) {
    if (std::any_of(box.face.begin(), box.face.end(), [&](int face) { return face >= 0 && is_taken_[size_t(face)]; }) ||
        is_claimed(field, box))
      continue;
    for (const int face : box.face) {
      if (face >= 0) is_taken_[size_t(face)] = 1;
    }
    found.push_back(measured(box, focal_tolerance));
  }
  std::sort(found.begin(), found.end(), [](const MeasuredBox& a, const MeasuredBox& b) {
    return a.size_m[0] * a.size_m[1] * a.size_m[2] > b.size_m[0] * b.size_m[1] * b.size_m[2];
  });
}

}  // namespace maq
