#include "head/stored_head.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "maquette/frame.h"

namespace maq::head {
namespace {

bool are_within(const std::vector<float>& values, float low, float high) {
  return std::all_of(values.begin(), values.end(), [&](float value) { return value >= low && value <= high; });
}

bool is_rotation(const Mat3& m) {
  const Mat3 product = m * transposed(m);
  for (size_t i = 0; i < 9; ++i) {
    if (!(std::abs(product[i] - kIdentity3[i]) <= 1e-6)) return false;
  }
  return dot(cross({m[0], m[1], m[2]}, {m[3], m[4], m[5]}), {m[6], m[7], m[8]}) > 0;
}

std::string camera_fault(const HeadCamera& camera) {
  const Vec3 t = camera.head_to_camera.translation;
  const auto is_side = [](int side) { return side >= 1 && side <= MAQ_MAX_SIDE_PX; };
  if (!is_side(camera.width_px) || !is_side(camera.height_px)) {
    return concatenate("one of its cameras sees a picture of ", camera.width_px, " x ", camera.height_px, " pixels");
  }
  if (!(camera.focal_px >= 1e-3 && camera.focal_px <= 1e9)) {
    return concatenate("one of its cameras has a focal length of ", camera.focal_px, " pixels");
  }
  if (!(std::abs(camera.cx_px) <= 1e9 && std::abs(camera.cy_px) <= 1e9)) {
    return "one of its cameras has a principal point that is not finite, or far away";
  }
  if (!is_rotation(camera.head_to_camera.rotation)) return "the rotation of one of its cameras is not one";
  if (!(std::abs(t.x) <= 1e9 && std::abs(t.y) <= 1e9 && std::abs(t.z) <= 1e9)) {
    return "one of its cameras is not at a finite position, or is far away";
  }
  return "";
}

std::string anchors_fault(const StoredAnchors& anchors) {
  constexpr float kReach = 2 * kMaxHeadExtent_dm;
  if (anchors.count() > kMaxHeadAnchors || anchors.template_points.size() != 3 * anchors.count() ||
      anchors.points.size() != 3 * anchors.count()) {
    return concatenate("the arrays of its anchors are not of one size, or of more than ", kMaxHeadAnchors);
  }
  if (!are_within(anchors.template_points, -kReach, kReach) || !are_within(anchors.points, -kReach, kReach) ||
      !are_within(anchors.sigma, 0, kReach)) {
    return concatenate("one of its anchors is not finite, or farther than ", kReach, " dm away");
  }
  return "";
}

}  // namespace

std::string stored_head_fault(const StoredHead& head) {
  if (!(head.sharpness >= 0.1f && head.sharpness <= 1e5f)) {
    return concatenate("its sharpness is ", head.sharpness, ", but must be 0.1 to 1e5");
  }
  const AlignedFloats& weights = head.weights.values();
  if (!std::all_of(weights.begin(), weights.end(), [](float value) { return std::isfinite(value); })) {
    return "one of its weights is not finite";
  }
  for (const std::vector<float>* codes : {&head.codes.shape, &head.codes.colour}) {
    if (codes->size() > size_t(kMaxFieldCodes) || !are_within(*codes, -1e6f, 1e6f)) {
      return concatenate("it has more than ", kMaxFieldCodes, " codes, or one that is not finite");
    }
  }
  // No photo makes a code less sure than it is a priori.
  if (const size_t codes = head.codes.shape.size();
      !head.code_factor.empty() &&
      (head.code_factor.size() != codes * (codes + 1) / 2 || !are_within(head.code_factor, -1.01f, 1.01f))) {
    return "the covariance of its codes is of another size, or larger than that of any head";
  }
  if (head.cameras.size() > kMaxStoredCameras) {
    return concatenate("it has ", head.cameras.size(), " cameras, but may have ", kMaxStoredCameras);
  }
  for (const HeadCamera& camera : head.cameras) {
    if (std::string fault = camera_fault(camera); !fault.empty()) return fault;
  }
  const HeadScale& scale = head.scale;
  if (!(scale.metres_per_unit >= 1e-6 && scale.metres_per_unit <= 1e6) || !(scale.sigma >= 0 && scale.sigma <= 1e6) ||
      scale.source > ScaleSource::kDepth) {
    return concatenate("its scale is ", scale.metres_per_unit, " (sigma ", scale.sigma, ") metres a unit, from source ",
                       int(scale.source));
  }
  for (std::string fault : {cut_fault(head.cut), bounds_fault(head.bounds), anchors_fault(head.anchors)}) {
    if (!fault.empty()) return fault;
  }
  const StoredTexture& texture = head.texture;
  if (texture.side_px < 0 || texture.side_px > kMaxTextureSide_px || texture.jpeg.size() > kMaxTextureBytes ||
      (texture.side_px == 0) != texture.jpeg.empty()) {
    return concatenate("its texture has ", texture.side_px, " pixels a side and ", texture.jpeg.size(), " bytes");
  }
  return landmarks_fault(head.landmarks);
}

}  // namespace maq::head
