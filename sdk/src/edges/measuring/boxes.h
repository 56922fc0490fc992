// Boxes: length, width and height from lines that meet at right angles.
#pragma once

#include <array>
#include <vector>

#include "edges/curves/edge_curves.h"

namespace maq {

struct MeasuredBox {
  Vec3 centre;
  std::array<Vec3, 3> axis;                // directions of length 1, at right angles
  std::array<double, 3> size_m;            // along each axis, the longest first
  std::array<double, 3> size_tolerance_m;  // two standard deviations
  int corners = 0;                         // visible corners, 4 to 7
};

class BoxFinder {
 public:
  // Corners in which lines meet within `tolerance_deg` of right angles start a box; lines that are connected to it and
  // run along its axes belong to it. A box needs a line between two corners along each of its three sides.
  // `focal_tolerance`: two standard deviations of the focal lengths, as a fraction; they stretch lengths across the
  // optical axis, and none along it.
  // `found` is overwritten: the largest volume first. Lines that bound more than one box belong to the first.
  void find(const EdgeField& field, const EdgeCurves& curves, std::vector<MeasuredBox>& found,
            double focal_tolerance = 0, double tolerance_deg = 8);

 private:
  struct Side {
    int curve, axis;
  };
  bool begin(const EdgeCurves& curves, int corner, double tolerance, std::array<Vec3, 3>& axes);
  void collect(const EdgeCurves& curves, int corner, double tolerance, const std::array<Vec3, 3>& axes);
  bool measure(const EdgeField& field, const EdgeCurves& curves, MeasuredBox& box) const;

  std::vector<Side> sides_;
  std::vector<int> to_visit_;
  std::vector<char> is_taken_, is_visited_;  // curves of a box; corners
};

}  // namespace maq
