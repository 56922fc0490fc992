#include "head/head_prior.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"

namespace maq::head {
namespace {

template <class... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  throw Error(MAQ_ERROR_BAD_BUNDLE, "The prior of heads cannot be used: ", parts..., ". Install the bundle again.");
}

bool are_within(const float* values, size_t count, float limit) {
  return std::all_of(values, values + count, [&](float value) { return std::abs(value) <= limit; });
}

void check_anchors(const HeadAnchors& anchors, size_t codes) {
  const size_t count = anchors.count();
  if (count < kMinHeadAnchors || count > kMaxHeadAnchors) {
    refuse("it has ", count, " anchors, but must have ", kMinHeadAnchors, " to ", kMaxHeadAnchors);
  }
  if (anchors.template_points.size() != 3 * count || anchors.mean.size() != 3 * count ||
      anchors.linear.size() != 3 * count * codes) {
    refuse("the arrays of its anchors are not of one size");
  }
  constexpr float kReach = 2 * kMaxHeadExtent_dm;
  if (!are_within(anchors.template_points.data(), 3 * count, kReach) ||
      !are_within(anchors.mean.data(), 3 * count, kReach) ||
      !are_within(anchors.linear.data(), anchors.linear.size(), kReach)) {
    refuse("one of its anchors is not finite, or farther than ", kReach, " dm away");
  }
  if (!std::all_of(anchors.sigma.begin(), anchors.sigma.end(), [](float s) { return s >= 1e-5f && s <= 10; })) {
    refuse("the standard deviation of one of its anchors is not within 1e-5 to 10 dm");
  }
}

// Throws unless nothing is wrong.
void check_fault(const std::string& fault) {
  if (!fault.empty()) refuse(fault);
}

}  // namespace

std::string cut_fault(const CutPlane& cut) {
  const Vec3 p = cut.point;
  const double reach = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const bool is_plane = is_finite(p) && reach <= double(kMaxHeadExtent_dm) && std::abs(length(cut.normal) - 1) <= 1e-3;
  return is_plane ? "" : "its cut plane has no point in the domain, or no normal of length 1";
}

std::string bounds_fault(const HeadBounds& bounds) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const float low = bounds.min[axis], high = bounds.max[axis];
    if (low >= -kMaxHeadExtent_dm && low < 0 && high > 0 && high <= kMaxHeadExtent_dm) continue;
    return concatenate("its domain is ", low, " to ", high, " dm along axis ", axis,
                       ", but must hold 0 and end within ", kMaxHeadExtent_dm);
  }
  return "";
}

std::string landmarks_fault(const std::vector<NamedPoint>& landmarks) {
  if (landmarks.size() > kMaxNamedPoints) {
    return concatenate("it has ", landmarks.size(), " landmarks, but may have ", kMaxNamedPoints);
  }
  std::set<std::string> names;
  for (const NamedPoint& landmark : landmarks) {
    if (landmark.name.empty() || landmark.name.size() > kMaxLandmarkName)
      return "one of its landmarks has no name or a long one";
    if (!names.insert(landmark.name).second)
      return concatenate("two of its landmarks are named \"", landmark.name, "\"");
    if (!are_within(landmark.template_point.data(), 3, 2 * kMaxHeadExtent_dm)) {
      return concatenate("its landmark \"", landmark.name, "\" is not finite, or far away");
    }
  }
  return "";
}

void check_head_prior(const HeadPrior& prior) {
  if (!(prior.sharpness >= 0.1f && prior.sharpness <= 1e5f)) {
    refuse("its sharpness is ", prior.sharpness, ", but must be 0.1 to 1e5");
  }
  if (!prior.bases.is_finite()) refuse("one of its weights is not finite");
  check_fault(cut_fault(prior.cut));
  check_fault(bounds_fault(prior.bounds));
  check_anchors(prior.anchors, size_t(prior.shape_codes()));
  check_fault(landmarks_fault(prior.landmarks));
}

}  // namespace maq::head
