// A photo as a capture's files describe it, before anything is read from disk.
#pragma once

#include <array>
#include <string>

#include "image/geometry/lens.h"

namespace maq {

struct PosedPhoto {
  std::string name;  // relative to the folder of the photos
  Lens lens;
  std::array<double, 9> rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // row by row: world to camera, in axes of OpenCV
  std::array<double, 3> centre = {0, 0, 0};
  std::string depth_name;    // of its depth image, in the same folder; "" without one
  double depth_unit_m = 0;   // units of the scene of a stored 1 in it; 0: as the kind of file has it
  bool is_held_out = false;  // kept to compare with: no scene is made of it
};

// Reasons why photos are dropped (import_report.h).
inline constexpr char kPhotosOutside[] = "photos whose name leads out of their folder";
inline constexpr char kPhotosMissing[] = "photos that are not in their folder";
inline constexpr char kDepthOutside[] = "depth images whose name leads out of their folder";
inline constexpr char kDepthMissing[] = "depth images that are not in their folder";
inline constexpr char kPhotosUnreadable[] = "photos that cannot be read as images";

// Also returns the fault of the photo's numbers; null if there is none.
const char* fault_of(const Lens& lens);
const char* fault_of_pose(const PosedPhoto& photo);

// Orthonormalises a rotation matrix (Gram-Schmidt) that is one to within 1 %. False, and nothing is changed, for other
// matrices, reflections among them.
bool make_exact_rotation(std::array<double, 9>& rotation);

}  // namespace maq
