// Boxes: length, width and height from flat faces that meet at right angles, and from what the box stands on.
#pragma once

#include <array>
#include <vector>

#include "edges/measuring/face_sides.h"

namespace maq {

struct MeasuredBox {
  Vec3 centre;
  std::array<Vec3, 3> axis;                // directions of length 1, at right angles
  std::array<double, 3> size_m;            // along each axis, the longest first
  std::array<double, 3> size_tolerance_m;  // two standard deviations
  int corners = 0;                         // visible corners: 4, 6 or 7
};

class BoxFinder {
 public:
  // Reads depth and intrinsics of a field. A box needs two or three faces at right angles, or one face above the plane
  // that it stands on. A side that is covered, or that the image cuts off, is not measured, nor is its box.
  // `focal_tolerance`: two standard deviations of the focal lengths, as a fraction; they stretch lengths across the
  // optical axis, and none along it.
  // `found` is overwritten: the largest volume first.
  void find(const EdgeField& field, std::vector<MeasuredBox>& found, double focal_tolerance = 0);

 private:
  // Faces have the index of their axis; -1: not seen.
  struct Candidate {
    std::array<int, 3> face{-1, -1, -1};
    std::array<Vec3, 3> axis;
    std::array<double, 3> low{}, high{}, low_sigma{}, high_sigma{};
    bool is_surrounded = false;  // a single face: what it stands on is seen all around it
    double score = 0;
  };
  struct SeenFace {
    bool is_seen = false;
    double position_m = 0, footprint_m = 0, slant = 0, area_px = 0;
  };
  using SeenFaces = std::array<SeenFace, 3>;
  struct Pair {
    int a, b, contacts;
  };

  const std::vector<BorderSample>& border_of(const EdgeField& field, int region);
  void find_pairs();
  void find_candidates(const EdgeField& field);
  double depth_of(const Candidate& box) const;
  static MeasuredBox measured(const Candidate& box, double focal_tolerance);
  void consider(const EdgeField& field, std::array<int, 3> faces);
  bool measure(const EdgeField& field, Candidate& box);
  bool measure_sides(const EdgeField& field, Candidate& box);
  bool stands_on_plane(const EdgeField& field, Candidate& box);
  bool has_plane_behind(int region) const;
  void turn_to_sides(Candidate& box);
  bool is_seen(const EdgeField& field, Candidate& box) const;
  bool is_claimed(const EdgeField& field, const Candidate& box);
  static SeenFaces faces_to_camera(const Candidate& box, double focal);
  double tolerance_at(const SeenFace& face, Vec3 point) const;
  template <class Visit>
  static bool raster(const EdgeField& field, const Candidate& box, const SeenFaces& faces, Visit&& visit);

  PlaneRegions regions_;
  FaceBorder border_;
  FaceExtent extent_;
  SideFinder side_;
  std::vector<std::vector<BorderSample>> borders_;
  std::vector<char> has_border_;
  std::vector<Pair> pairs_;
  std::vector<Candidate> candidates_;
  std::vector<char> is_taken_, claims_;
};

}  // namespace maq
