// 3D Gaussians ("splats": Kerbl et al. 2023, arXiv 2308.04079) in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

// Coefficients of spherical harmonics above degree 0, for degrees 0 to 3 and each colour.
inline constexpr int kMaxShDegree = 3;
inline constexpr int kMaxShTerms = 15;
inline constexpr int sh_terms(int degree) { return (degree + 1) * (degree + 1) - 1; }

// A coefficient is stored in steps of this; it is at most 32767 of them, 8 or so.
inline constexpr float kShStep = 1.0f / 4096;

// The constant of degree 0: a colour is 0.5 + kShConstant * coefficient.
inline constexpr float kShConstant = 0.28209479177387814f;

struct Splat {
  std::array<double, 3> position = {0, 0, 0};    // in the world
  std::array<float, 3> scale = {0, 0, 0};        // standard deviations along the splat's own axes
  std::array<float, 4> rotation = {1, 0, 0, 0};  // quaternion w, x, y, z: own axes to the world; any length but 0
  float opacity = 0;                             // at the middle, 0 to 1
  std::array<float, 3> colour = {0, 0, 0};       // red, green, blue of degree 0; mostly 0 to 1
};

struct Splats {
  std::array<double, 3> origin = {0, 0, 0};
  std::array<double, 3> up = {0, -1, 0};  // files of splats have the axes of OpenCV
  bool is_antialiased = false;            // trained so that small splats become transparent (Mip-Splatting)
  int stored_bits = 32;                   // of a number in the file
  std::vector<float> position;            // [count][3], relative to the origin
  std::vector<float> scale;               // [count][3]
  std::vector<float> rotation;            // [count][4], of length 1
  std::vector<float> opacity;             // [count]
  std::vector<float> colour;              // [count][3]
  int sh_degree = 0;
  std::vector<int16_t> sh;  // [count][sh_terms(sh_degree)][3], in steps of kShStep

  size_t count() const { return opacity.size(); }
  void reserve(size_t count);
  // Adds a splat, without its harmonics. False, and nothing is added, when a number is not finite, a scale is negative,
  // a position or scale is too large to calculate with, or the rotation has no length. The first one is the origin.
  bool add(const Splat& splat);
};

// Returns the coefficient in steps of kShStep; larger ones are cut. NaN becomes 0.
int16_t sh_steps(double coefficient);

// One of them, whose rotation has length 1; without its harmonics.
Splat splat_at(const Splats& splats, size_t index);

// The box of all middles, in the world: low, then high.
std::array<std::array<double, 3>, 2> bounds_of(const Splats& splats);

}  // namespace maq
