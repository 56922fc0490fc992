// Where the face of a box ends: its border in the image, and the four sides of its rectangle.
#pragma once

#include <array>
#include <vector>

#include "edges/measuring/plane_regions.h"

namespace maq {

// A point on the border of a face, halfway between its last pixel and the next.
struct BorderSample {
  enum class Kind : uint8_t {
    kFree,     // what is beyond is farther: the face ends here
    kContact,  // another flat surface begins here: a crease
    kUnknown,  // something nearer covers the face, or depth ends
  };
  Vec3 point;
  Vec3 outward;  // in the face, length 1
  Kind kind = Kind::kUnknown;
  uint8_t beyond = 0;          // label of the region beyond; 0: none
  uint8_t widening_px = 0;     // pixels that the sensor added, already taken off
  bool is_across_gap = false;  // depth is unknown for several pixels before what is beyond
};

// One side of the rectangle of a face.
struct FaceSide {
  bool is_known = false;
  double position_m = 0;  // along an axis
  double sigma_m = 0;     // its standard deviation
  double sag = 0;         // by how much it falls back towards its ends, as a straight side does not; 1: too much
  double seen = 0;        // fraction of the side along which the face is seen to end
};

// Finds the border of one region. `samples` is overwritten.
class FaceBorder {
 public:
  void find(const EdgeField& field, const PlaneRegions& regions, int region, std::vector<BorderSample>& samples);

 private:
  std::vector<uint8_t> mask_;
};

// The extent of a region along a direction: without the outermost 0.5 % of its pixels on either side.
class FaceExtent {
 public:
  std::array<double, 2> of(const PlaneRegions& regions, int region, Vec3 axis);

 private:
  std::vector<double> positions_;
};

// Returns the distance between neighbouring pixels on a plane at a point.
double spacing_on(const Plane& plane, Vec3 point, double focal_px);

// The standard deviation of the position of a region's plane.
double plane_sigma(const PlaneRegions& regions, int region, double focal_px);

// Measures the side of a face towards `sign` * `along`. `extents`: of the region along `along` and `across`.
class SideFinder {
 public:
  FaceSide find(const PlaneRegions& regions, int region, const std::vector<BorderSample>& samples, Vec3 along,
                Vec3 across, int sign, const std::array<double, 2>& extent, const std::array<double, 2>& extent_across,
                double focal_px);

 private:
  std::vector<double> positions_, sorted_;
  std::vector<const BorderSample*> used_;
};

}  // namespace maq
