// A head's field network on batches of points: values, and gradients by points and weights.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "head/field/field_isa.h"
#include "head/field/field_weights.h"

namespace maq::head {

// Coordinates in the head's frame (dm), each an array of `count`. The encoding is exact to 2e-7 within 60 dm at six
// octaves; a point that is not finite has NaN as its values, and no effect on others' values.
struct FieldPoints {
  const float* x;
  const float* y;
  const float* z;
  size_t count;
};

using Planes = std::array<float*, 3>;
using ConstPlanes = std::array<const float*, 3>;

// The output arrays of forward(), with one element for each point. Planes that are null are left out. If all six planes
// of the surface are null, its network does not run. If all three planes of `normal` are null, the normal is not
// computed.
struct FieldValues {
  float* distance = nullptr;
  Planes rgb{};  // logits
  Planes template_point{};
  Planes normal{};  // the gradient of the distance by the point: not of length 1
};

// The gradient of a loss by FieldValues; null: 0.
struct FieldValueGradient {
  const float* distance = nullptr;
  ConstPlanes rgb{};
  ConstPlanes template_point{};
};

enum class WeightGradient {
  kNone,
  kPersonal,
  kPersonalGeometry,  // the personal layers of one of the networks
  kPersonalSurface,   // and its cost: the geometry runs only for the points
  kAll
};

// The memory that calls share: grows to the largest batch and is not given back. One a thread.
class FieldWorkspace {
 private:
  friend class FieldEngine;

  AlignedFloats blocks_;            // of all blocks, for backward()
  AlignedFloats scratch_;           // of one block
  std::vector<uint64_t> left_out_;  // of each block that is kept: its points that have a value that is not finite
  size_t count_ = 0;                // of points that are kept
  bool is_kept_ = false, has_surface_ = false;
};

// Calls are const and know no state but the workspace's, so that threads may share an engine. Results do not depend on
// how points are split into batches, but for sums over points; these are in the order of the points.
//
// Nothing allocates once a workspace has seen a batch as large. A batch that backward() follows keeps some 2 KB a point
// (width 64), so that one of 256 points stays in a core's second cache.
class FieldEngine {
 public:
  // Throws as check_field_shape() and field_kernels() do. Weights are 0.
  explicit FieldEngine(const FieldShape& shape, FieldIsa isa = fastest_field_isa());

  const FieldShape& shape() const { return shape_; }
  FieldIsa isa() const { return isa_; }

  // Copies the weights into the order in which they are read, forwards and backwards; some 15 us at width 64. Throws
  // MAQ_ERROR_INTERNAL where they are of another shape.
  void set_weights(const FieldWeights& weights);

  // gradient: of the distance, by the point; null planes are left out, and where all are, it is not computed.
  void distances(const FieldPoints& points, FieldWorkspace& workspace, float* distance,
                 const Planes& gradient = {}) const;

  // Keeps the values for backward() in the workspace, until the next call with this workspace.
  void forward(const FieldPoints& points, FieldWorkspace& workspace, const FieldValues& values) const;
  // Adds to `weights` (may be null for kNone), writes the gradient by the points (null planes: left out). May be
  // called more than once. Points that have a value or a gradient that is not finite are left out: they have no part in
  // the sums, and 0 as their gradient; returns how many. Throws MAQ_ERROR_INTERNAL if forward() kept nothing, or
  // did not compute a value with a given gradient.
  size_t backward(FieldWorkspace& workspace, const FieldValueGradient& gradient, WeightGradient which,
                  FieldWeights* weights, const Planes& points_gradient = {}) const;

 private:
  struct Layer {
    size_t forward, backward, bias;  // in packed_
    int inputs, outputs;
  };
  // Blocks of one call, within the workspace: of max_rows_ rows, and of 3.
  struct Scratch {
    float *a, *b, *transposed, *points;
  };
  // A block that is kept: rows of the encoding, of the hidden layers of the geometry, of the input and the hidden
  // layers of the surface (has_surface).
  struct Block {
    float *encoding, *geometry, *surface_input, *surface;
  };
  struct Sums {
    WeightGradient which;
    FieldWeights* weights;
    float* transposed;
  };

  Scratch scratch(FieldWorkspace& workspace) const;
  // Memory for so many points.
  void keep(FieldWorkspace& workspace, size_t count, bool has_surface) const;
  size_t kept_rows(bool has_surface) const;
  Block block(FieldWorkspace& workspace, size_t begin) const;

  const Layer& layer(int index) const { return layers_[size_t(index)]; }
  // The activations of the i-th hidden layer of the geometry, or arrays with the same layout.
  float* hidden(float* rows, int i) const { return rows + size_t(i) * size_t(shape_.width * kFieldBlock); }
  float* surface_hidden(float* rows, int i) const {
    return rows + size_t(i) * size_t(shape_.surface_width * kFieldBlock);
  }
  void run_activated(int index, const float* in, float* out) const;
  void run_affine(int index, const float* in, float* out) const;
  void run_transposed(int index, int used, const float* gradient, float* out) const;
  void run_geometry(const Block& at) const;
  void run_distance(const Block& at, float* out) const;
  void run_surface(const Block& at, float* out) const;
  void run_slopes(const Block& at, const Scratch& scratch) const;

  void check_backward(const FieldWorkspace& workspace, const FieldValueGradient& gradient, const Sums& sums) const;
  bool wants(const Sums& sums, int index) const;
  void add_weight_gradient(const Sums& sums, int index, int outputs, const float* gradient, const float* in) const;
  // Converts scratch.a from the gradient by the network's output to the gradient by its input.
  void surface_backward(const Block& at, const Sums& sums, Scratch& scratch) const;
  // From scratch.a, the gradient by what the output layer gave (of which `used` rows), to that by the encoding, unless
  // that is not asked for.
  void geometry_backward(const Block& at, const Sums& sums, int used, bool to_input, Scratch& scratch) const;

  FieldShape shape_;
  FieldIsa isa_;
  const FieldKernels* kernels_;
  std::vector<Layer> layers_;
  AlignedFloats packed_;
  size_t distance_row_ = 0;  // in packed_: the geometry's output layer, without the feature
  size_t max_rows_ = 0, max_stride_ = 0;
};

}  // namespace maq::head
