// One fitted head as it is kept: everything that showing, measuring and exporting it take, without its photos and
// without the prior that it was fitted with. Plain data; files/ reads and writes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "head/camera/head_camera.h"
#include "head/field/weight_bases.h"
#include "head/head_prior.h"

namespace maq::head {

inline constexpr size_t kMaxStoredCameras = 256;

// How large a head is. The values are stored: new ones come at the end.
enum class ScaleSource : uint8_t {
  kPrior,  // as large as heads are on average
  kGiven,  // by the app: a known distance, such as between the pupils
  kDepth,  // by a depth camera
};

struct HeadScale {
  double metres_per_unit = 0.1;  // of the head frame's
  double sigma = 0;              // its standard deviation, metres a unit
  ScaleSource source = ScaleSource::kPrior;
};

// Points of the template head's surface, and where they lie on this head.
struct StoredAnchors {
  std::vector<float> template_points;  // [count][3], dm, in the template head's frame
  std::vector<float> points;           // [count][3], dm
  std::vector<float> sigma;            // [count], dm, each coordinate

  size_t count() const { return sigma.size(); }
};

// The only part of a head that has pixels of photos; made when it is asked for. head/texture says how it is laid out.
struct StoredTexture {
  int side_px = 0;            // 0: there is none
  std::vector<uint8_t> jpeg;  // a whole file, of side_px x side_px pixels
};

inline constexpr int kMaxTextureSide_px = 2048;
inline constexpr size_t kMaxTextureBytes = 6 << 20;

struct StoredHead {
  explicit StoredHead(FieldWeights of_head) : weights(std::move(of_head)) {}

  FieldWeights weights;  // combined
  FieldCodes codes;      // the codes of these weights, for another fit
  // How sure the photos made the shape codes: the Cholesky factor of their covariance, lower triangle, row by row.
  // Empty: not known, and no photo can be added.
  std::vector<float> code_factor;
  std::vector<HeadCamera> cameras;  // of its photos
  HeadScale scale;
  float sharpness = 64;  // s of the opacity along rays, 1/dm
  CutPlane cut;
  HeadBounds bounds;
  StoredAnchors anchors;  // may be empty
  std::vector<NamedPoint> landmarks;
  StoredTexture texture;
  std::array<uint8_t, 32> prior_sha256{};  // of the prior's file, which the codes belong to; zeros: not known
};

// Returns the fault of a head ("one of its cameras …"), or an empty text. All numbers must be finite, and sizes must
// agree. Cameras have orthonormal rotations (within 1e-6), images of 1 to MAQ_MAX_SIDE_PX, and focal lengths of 1e-3 to
// 1e9 pixels.
std::string stored_head_fault(const StoredHead& head);

}  // namespace maq::head
