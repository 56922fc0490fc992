// A head's field network on batches of points: values, and gradients by points and weights.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "head/field/field_isa.h"
#include "head/field/field_weights.h"

namespace maq::head {

// Coordinates in the head's frame (dm), each an array of `count`. The encoding is exact to 2e-7 within 64 dm at six
// octaves; a point that is not finite has NaN as its values, and no effect on others' values.
struct FieldPoints {
  const float* x;
  const float* y;
  const float* z;
  size_t count;
};

using Planes = std::array<float*, 3>;
using ConstPlanes = std::array<const float*, 3>;

// What forward() fills in: arrays of as many as there are points. Planes that are null are left out; where all six of
// the surface are, its network does not run.
struct FieldValues {
  float* distance = nullptr;
  Planes rgb{};  // logits
  Planes template_point{};
};

// The gradient of a loss by FieldValues; null: 0.
struct FieldValueGradient {
  const float* distance = nullptr;
  ConstPlanes rgb{};
  ConstPlanes template_point{};
};

enum class WeightGradient { kNone, kPersonal, kAll };

// The memory that calls share: grows to the largest batch and is not given back. One a thread.
class FieldWorkspace {
 private:
  friend class FieldEngine;
  enum class Kept { kNothing, kGeometry, kSurface, kTangents };

  AlignedFloats blocks_;   // activations of all blocks
  AlignedFloats scratch_;  // of one block
  size_t count_ = 0;       // of points that are kept
  Kept kept_ = Kept::kNothing;
};

// Calls are const and know no state but the workspace's, so that threads may share an engine. Results do not depend on
// how points are split into batches, but for sums over points; these are in the order of the points.
//
// Nothing allocates once a workspace has seen a batch as large. A batch that backward() follows keeps some 2 KB a point
// (width 64), so that one of 500 points stays in a core's second cache.
class FieldEngine {
 public:
  // Throws as check_field_shape() and field_kernels() do. Weights are 0.
  explicit FieldEngine(const FieldShape& shape, FieldIsa isa = fastest_field_isa());

  const FieldShape& shape() const { return shape_; }
  FieldIsa isa() const { return isa_; }

  // Copies the weights into the order in which they are read, forwards and backwards; some 20 us at width 64. Throws
  // MAQ_ERROR_INTERNAL where they are of another shape.
  void set_weights(const FieldWeights& weights);

  void distances(const FieldPoints& points, FieldWorkspace& workspace, float* distance) const;
  // gradient: of the distance, by the point.
  void distances_and_gradients(const FieldPoints& points, FieldWorkspace& workspace, float* distance,
                               const Planes& gradient) const;

  // Keeps what backward() needs in the workspace, until the next call with it.
  void forward(const FieldPoints& points, FieldWorkspace& workspace, const FieldValues& values) const;
  // Adds to `weights` (may be null for kNone), writes the gradient by the points (null planes: left out). May be called
  // more than once. Points with a gradient that is not finite spoil sums. Throws MAQ_ERROR_INTERNAL where forward()
  // kept nothing, or no surface and a gradient by it is given.
  void backward(FieldWorkspace& workspace, const FieldValueGradient& gradient, WeightGradient which,
                FieldWeights* weights, const Planes& points_gradient = {}) const;

  // The distance and its gradient by the point (not of length 1), by forward differentiation: keeps what
  // backward_normals() needs.
  void forward_normals(const FieldPoints& points, FieldWorkspace& workspace, float* distance,
                       const Planes& normal) const;
  // From the gradient of a loss by the distance (null: 0) and by the normal, adds that by the weights of the geometry
  // layers. Throws as backward() does.
  void backward_normals(FieldWorkspace& workspace, const float* distance_gradient, const ConstPlanes& normal_gradient,
                        WeightGradient which, FieldWeights& weights) const;

 private:
  struct Layer {
    size_t forward, backward, bias;  // in packed_
    size_t stride;
    int inputs, outputs;
  };
  // Blocks of one call, within the workspace.
  struct Scratch {
    float *points, *a, *b, *transposed;
  };
  // The hidden layers of one of the two networks in a block that is kept. slopes: null without tangents.
  struct Hidden {
    int first_layer, layers, rows;
    float *input, *activations, *slopes;
  };
  // Where weight gradients go; bias_columns: of a block, those of values.
  struct Sums {
    WeightGradient which;
    FieldWeights* weights;
    float* transposed;
    int bias_columns;
  };

  static float* last_activations(const Hidden& hidden) {
    return hidden.activations + size_t(hidden.layers - 1) * size_t(hidden.rows) * kFieldBlock;
  }
  Scratch scratch(FieldWorkspace& workspace) const;
  float* keep(FieldWorkspace& workspace, FieldWorkspace::Kept kept, size_t count) const;
  size_t kept_rows(FieldWorkspace::Kept kept) const;
  Hidden geometry(float* block, bool has_tangents) const;
  Hidden surface(float* block) const;

  const Layer& layer(int index) const { return layers_[size_t(index)]; }
  void run_hidden(const Hidden& hidden) const;
  void run_output(int index, const float* in, float* out) const;
  void run_distance(const Hidden& geometry, float* out) const;
  void check_sums(const Sums& sums) const;
  void add_weight_gradient(const Sums& sums, int index, int outputs, const float* gradient, const float* in) const;
  // From the gradient by the last hidden layer's activations to that by the first one's affine result: `gradient` or
  // `other`, whichever is returned.
  float* run_backward(const Hidden& hidden, const Sums& sums, float* gradient, float* other) const;
  // `gradient`: by the first layer's affine result. points: [3][kFieldBlock], what is added where `adds`.
  void put_points_gradient(const Hidden& geometry, const float* gradient, float* other, bool adds, float* points,
                           size_t count, size_t begin, const Planes& points_gradient) const;

  FieldShape shape_;
  FieldIsa isa_;
  const FieldKernels* kernels_;
  std::vector<Layer> layers_;
  AlignedFloats packed_;
  size_t distance_row_ = 0;  // in packed_: the geometry's output layer, without the feature
  size_t max_rows_ = 0, max_stride_ = 0;
};

// The eikonal term: the sum over points of (|g| - 1)², in double. Fills in its gradient by g times `scale`; where g is
// 0 the norm's derivative is taken as 0. Finite for all finite g.
double eikonal_loss(size_t count, const ConstPlanes& g, float scale, const Planes& gradient);

}  // namespace maq::head
