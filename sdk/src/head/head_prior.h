// The statistical model of heads: the field's bases, the points of a template head on a head with given codes, and the
// clip plane of a head. Plain data; files/ reads it, fit/ uses it.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "core/math/vec3.h"
#include "head/field/weight_bases.h"

namespace maq::head {

inline constexpr size_t kMinHeadAnchors = 4, kMaxHeadAnchors = 16384;
inline constexpr size_t kMaxNamedPoints = 256, kMaxLandmarkName = 64;  // names in bytes
inline constexpr float kMaxHeadExtent_dm = 8;  // of the domain, along each axis, from the origin

// Where a head ends, below the chin. The distance of a head is max(the field's, that to this plane).
struct CutPlane {
  Vec3 point{0, 0, -1.5};
  Vec3 normal{0, 0, -1};  // of length 1, out of the head

  double distance(Vec3 p) const { return dot(p - point, normal); }
};

// Where the field was learnt (dm).
struct HeadBounds {
  std::array<float, 3> min{-2.2f, -2.2f, -2.2f}, max{2.2f, 2.2f, 2.2f};
};

// Points of the template head's surface, and where they lie on a head with shape codes z: mean + A z.
struct HeadAnchors {
  std::vector<float> template_points;  // [count][3], dm, in the template head's frame
  std::vector<float> mean;             // [count][3], dm
  std::vector<float> linear;           // [count][3][shape codes]: A, dm a unit of a code
  std::vector<float> sigma;            // [count], dm: residual of the linear function, for each coordinate

  size_t count() const { return sigma.size(); }
};

// A named landmark: "nose_tip", "chin", "pupil_left", "pupil_right", "ear_top_left", …
struct NamedPoint {
  std::string name;
  std::array<float, 3> template_point{};
};

// Codes are whitened: of a head that nothing is known of, each is normal with mean 0 and variance 1.
struct HeadPrior {
  explicit HeadPrior(WeightBases of_heads) : bases(std::move(of_heads)) {}

  WeightBases bases;
  float sharpness = 64;  // s of the opacity along rays, 1/dm
  CutPlane cut;
  HeadBounds bounds;
  HeadAnchors anchors;
  std::vector<NamedPoint> landmarks;

  int shape_codes() const { return bases.shape_codes(); }
  int colour_codes() const { return bases.colour_codes(); }
};

// Returns the fault of such a part of a prior or of a head ("its domain is …"), or an empty text. A clip plane's normal
// has length 1 (within 1e-3). Bounds contain 0 and end within kMaxHeadExtent_dm. Names are unique and have 1 to
// kMaxLandmarkName bytes. Landmarks lie within twice kMaxHeadExtent_dm.
std::string cut_fault(const CutPlane& cut);
std::string bounds_fault(const HeadBounds& bounds);
std::string landmarks_fault(const std::vector<NamedPoint>& landmarks);

// Throws MAQ_ERROR_BAD_BUNDLE, with what is wrong, unless all numbers are finite and sizes agree: sharpness 0.1 to 1e5,
// the cut's normal of length 1 (within 1e-3), bounds within kMaxHeadExtent_dm around the origin, anchors within twice
// that (the template's, the mean's), kMinHeadAnchors to kMaxHeadAnchors of them with sigmas in 1e-5..10 dm, names of 1
// to kMaxLandmarkName bytes and no two alike.
void check_head_prior(const HeadPrior& prior);

}  // namespace maq::head
