// Sizes of a body: lengths and girths of its shape in rest pose, metres.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "body/model/body_model.h"

namespace maq::body {

using ShapeNumbers = std::array<double, kMaxShapes>;

// In the order of Sizes.
enum class Size : uint8_t { kHeight, kChest, kWaist, kHip, kInseam };
inline constexpr size_t kSizes = 5;
using Sizes = std::array<double, kSizes>;

// A length that is linear in the shape.
struct ShapeLength {
  double rest_m = 0;
  ShapeNumbers by_shape_m{};

  double of(const ShapeNumbers& shape) const;
};

// From the lowest to the highest vertex of the mean shape.
ShapeLength height_of(const BodyModel& model);

// Girths are perimeters of the convex hull of a horizontal section of the torso without the arms. The section is at a
// fixed fraction of the way from the hip joints to the neck: -0.05 for the hip, 0.35 for the waist, 0.65 for the chest.
// The inseam goes from the crotch down to the soles.
class BodySizes {
 public:
  // Throws MAQ_ERROR_BAD_BUNDLE for a model without the joints that it needs.
  explicit BodySizes(const BodyModel& model);

  Sizes sizes_m(const ShapeNumbers& shape) const;

 private:
  struct Vertex {
    Vec3 rest;
    ShapeVectors basis;
  };

  size_t shape_count_;
  ShapeLength height_, inseam_;
  std::array<ShapeLength, 3> level_;  // z of the sections: chest, waist, hip
  std::vector<Vertex> torso_;
  std::vector<uint32_t> triangles_;  // of torso_, three each
};

}  // namespace maq::body
