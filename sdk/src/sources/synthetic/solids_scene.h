// The solids of stub:solids, and how its camera moves among them: metres, with x to the right, y down and z forward, as
// a camera at the origin has them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace maq {

// A type of this namespace, so that its operators are found.
struct Vector3 : std::array<double, 3> {};

// A box that stands upright, turned about its y axis (x' = cos x - sin z, z' = sin x + cos z), or the upright cylinder
// in it, whose rims the truth begins to divide in that direction.
struct Solid {
  Vector3 centre{}, half{};  // half of its sizes
  double cosine = 1, sine = 0;
  double radius = 0;       // of a cylinder; 0: a box
  bool is_carton = false;  // an object to measure; false: a floor, a wall, furniture, a part
};

// Solids touch one another, but none is partly inside another one, but for the parts of a box with a rounded edge: two
// boxes and a cylinder, all of one height.
struct SolidsScene {
  std::vector<Solid> solids;
  // The camera looks at the target. Its direction from there turns with time, all around or to and fro in 24 s.
  Vector3 target{};
  double distance = 0;
  double pitch_turns = 0;  // downwards; of 1 turn
  double swing_turns = 0;  // to each side; 0: all around
  double first_turns = 0;  // the direction at time 0
};

// `name`: "wall" (one plane), "box" (a carton on a floor), "shelf" (cartons and a rounded box on boards) or "room" (a
// corner with a table, cartons, a bin and a rounded box). Sizes and positions follow from `seed`. Throws
// MAQ_ERROR_INVALID_ARGUMENT for another name.
SolidsScene make_solids_scene(const std::string& name, uint64_t seed);

// The axes of the camera as rows, and its place, in the world: a point p appears at axes * (p - centre).
struct SolidsView {
  std::array<Vector3, 3> axes{};
  Vector3 centre{};
};
SolidsView solids_view(const SolidsScene& scene, double time_s);

// The pinhole camera of all views: square pixels, the principal point in the middle, a field of view of 56 degrees from
// left to right.
struct SolidsPicture {
  int width_px = 0, height_px = 0;
  double focal_px() const { return width_px * (15.0 / 16); }
  double centre_x_px() const { return 0.5 * (width_px - 1); }
  double centre_y_px() const { return 0.5 * (height_px - 1); }
};

inline double dot(const Vector3& a, const Vector3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector3 operator+(const Vector3& a, const Vector3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vector3 operator-(const Vector3& a, const Vector3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vector3 operator*(double s, const Vector3& a) { return {s * a[0], s * a[1], s * a[2]}; }

}  // namespace maq
