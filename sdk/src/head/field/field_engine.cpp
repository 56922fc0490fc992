#include "head/field/field_engine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"

namespace maq::head {
namespace {

constexpr size_t kBlock = kFieldBlock;

// Points from `begin` on into rows of `width`; those beyond the last are 0.
void gather(const FieldPoints& points, size_t begin, size_t width, float* rows) {
  const size_t count = std::min(width, points.count - begin);
  const float* const axes[3] = {points.x, points.y, points.z};
  for (int axis = 0; axis < 3; ++axis) {
    float* row = rows + size_t(axis) * width;
    std::copy_n(axes[axis] + begin, count, row);
    std::fill(row + count, row + width, 0.0f);
  }
}

// The first `count` of a row; null: not wanted.
void put(const float* row, size_t count, size_t begin, float* to) {
  if (to != nullptr) std::copy_n(row, count, to + begin);
}

// Null: zeros.
void take(const float* from, size_t begin, size_t count, float* row, size_t width) {
  if (from == nullptr) count = 0;
  if (count > 0) std::copy_n(from + begin, count, row);
  std::fill(row + count, row + width, 0.0f);
}

template <class Pointer>
bool has_any(const std::array<Pointer, 3>& planes) {
  return planes[0] != nullptr || planes[1] != nullptr || planes[2] != nullptr;
}

}  // namespace

FieldEngine::FieldEngine(const FieldShape& shape, FieldIsa isa)
    : shape_(shape), isa_(isa), kernels_(&field_kernels(isa)) {
  const std::vector<FieldLayerPlace> places = field_layer_places(shape);
  size_t end = 0;
  for (int index = 0; index < shape.layers(); ++index) {
    Layer next;
    next.inputs = shape.inputs(index);
    next.outputs = shape.outputs(index);
    next.stride = places[size_t(index)].stride;
    const size_t size = size_t(next.inputs) * size_t(next.outputs);
    next.forward = end;
    next.backward = end + size;
    next.bias = end + 2 * size;
    end = next.bias + size_t(next.outputs);
    max_rows_ = std::max({max_rows_, size_t(next.inputs), size_t(next.outputs)});
    max_stride_ = std::max(max_stride_, next.stride);
    layers_.push_back(next);
  }
  distance_row_ = end;
  packed_.assign(end + size_t(shape.width), 0.0f);
}

void FieldEngine::set_weights(const FieldWeights& weights) {
  if (weights.shape() != shape_) throw Error(MAQ_ERROR_INTERNAL, "Weights and engine are of two shapes of field.");
  for (int index = 0; index < shape_.layers(); ++index) {
    const Layer& to = layer(index);
    const ConstFieldLayer from = weights.layer(index);
    kernels_->pack(from.weights, from.stride, to.outputs, to.inputs, packed_.data() + to.forward);
    kernels_->pack_transposed(from.weights, from.stride, to.inputs, to.outputs, packed_.data() + to.backward);
    std::copy_n(from.bias, to.outputs, packed_.data() + to.bias);
  }
  std::copy_n(weights.layer(shape_.geometry_layers).weights, shape_.width, packed_.data() + distance_row_);
}

// --- memory
// -----------------------------------------------------------------------------------------------------------

FieldEngine::Scratch FieldEngine::scratch(FieldWorkspace& workspace) const {
  const size_t size = (3 + 2 * max_rows_ + max_stride_) * kBlock;
  if (workspace.scratch_.size() < size) workspace.scratch_.resize(size);
  float* begin = workspace.scratch_.data();
  float* a = begin + 3 * kBlock;
  return {begin, a, a + max_rows_ * kBlock, a + 2 * max_rows_ * kBlock};
}

size_t FieldEngine::kept_rows(FieldWorkspace::Kept kept) const {
  const size_t hidden = size_t(shape_.geometry_layers) * size_t(shape_.width);
  size_t rows = size_t(shape_.encoding()) + hidden;
  if (kept == FieldWorkspace::Kept::kTangents) rows += hidden;
  if (kept == FieldWorkspace::Kept::kSurface) {
    rows += size_t(shape_.surface_inputs()) + size_t(shape_.surface_layers) * size_t(shape_.surface_width);
  }
  return rows;
}

// Memory for the blocks of so many points; workspace.kept_ is to be set when they are filled.
float* FieldEngine::keep(FieldWorkspace& workspace, FieldWorkspace::Kept kept, size_t count) const {
  const size_t width = kept == FieldWorkspace::Kept::kTangents ? size_t(kTangentPoints) : kBlock;
  const size_t size = (count + width - 1) / width * kept_rows(kept) * kBlock;
  workspace.kept_ = FieldWorkspace::Kept::kNothing;
  if (workspace.blocks_.size() < size) workspace.blocks_.resize(size);
  workspace.count_ = count;
  return workspace.blocks_.data();
}

FieldEngine::Hidden FieldEngine::geometry(float* block, bool has_tangents) const {
  float* activations = block + size_t(shape_.encoding()) * kBlock;
  float* end = activations + size_t(shape_.geometry_layers) * size_t(shape_.width) * kBlock;
  return {0, shape_.geometry_layers, shape_.width, block, activations, has_tangents ? end : nullptr};
}

FieldEngine::Hidden FieldEngine::surface(float* block) const {
  float* input = block + kept_rows(FieldWorkspace::Kept::kGeometry) * kBlock;
  float* activations = input + size_t(shape_.surface_inputs()) * kBlock;
  return {shape_.first_surface_layer(), shape_.surface_layers, shape_.surface_width, input, activations, nullptr};
}

// --- forwards
// ---------------------------------------------------------------------------------------------------------

void FieldEngine::run_hidden(const Hidden& hidden) const {
  const float* in = hidden.input;
  const size_t size = size_t(hidden.rows) * kBlock;
  for (int i = 0; i < hidden.layers; ++i) {
    const Layer& at = layer(hidden.first_layer + i);
    float* out = hidden.activations + size_t(i) * size;
    const float* weights = packed_.data() + at.forward;
    const float* bias = packed_.data() + at.bias;
    if (hidden.slopes == nullptr) {
      kernels_->affine_activated(weights, bias, at.outputs, at.inputs, shape_.smoothing, in, out);
    } else {
      kernels_->affine_activated_tangents(weights, bias, at.outputs, at.inputs, shape_.smoothing, in, out,
                                          hidden.slopes + size_t(i) * size);
    }
    in = out;
  }
}

void FieldEngine::run_output(int index, const float* in, float* out) const {
  const Layer& at = layer(index);
  kernels_->affine(packed_.data() + at.forward, packed_.data() + at.bias, at.outputs, at.inputs, in, out);
}

// One row; of a block with tangents, without the bias.
void FieldEngine::run_distance(const Hidden& geometry, float* out) const {
  const float* in = last_activations(geometry);
  const float* row = packed_.data() + distance_row_;
  if (geometry.slopes != nullptr) {
    kernels_->multiply(row, 1, shape_.width, shape_.width, in, out);
  } else {
    kernels_->affine(row, packed_.data() + layer(shape_.geometry_layers).bias, 1, shape_.width, in, out);
  }
}

void FieldEngine::distances(const FieldPoints& points, FieldWorkspace& workspace, float* distance) const {
  const Scratch at = scratch(workspace);
  const Hidden hidden =
      geometry(keep(workspace, FieldWorkspace::Kept::kGeometry, std::min(points.count, kBlock)), false);
  for (size_t begin = 0; begin < points.count; begin += kBlock) {
    gather(points, begin, kBlock, at.points);
    kernels_->encode(at.points, shape_.octaves, hidden.input);
    run_hidden(hidden);
    run_distance(hidden, at.a);
    put(at.a, std::min(kBlock, points.count - begin), begin, distance);
  }
}

void FieldEngine::distances_and_gradients(const FieldPoints& points, FieldWorkspace& workspace, float* distance,
                                          const Planes& gradient) const {
  const Scratch at = scratch(workspace);
  const Hidden hidden =
      geometry(keep(workspace, FieldWorkspace::Kept::kGeometry, std::min(points.count, kBlock)), false);
  const Layer& output = layer(shape_.geometry_layers);
  const Sums none{WeightGradient::kNone, nullptr, nullptr, 0};
  for (size_t begin = 0; begin < points.count; begin += kBlock) {
    const size_t count = std::min(kBlock, points.count - begin);
    gather(points, begin, kBlock, at.points);
    kernels_->encode(at.points, shape_.octaves, hidden.input);
    run_hidden(hidden);
    run_distance(hidden, at.a);
    put(at.a, count, begin, distance);

    std::fill_n(at.b, kBlock, 1.0f);
    kernels_->multiply(packed_.data() + output.backward, output.inputs, output.outputs, 1, at.b, at.a);
    float* gradients = run_backward(hidden, none, at.a, at.b);
    put_points_gradient(hidden, gradients, gradients == at.a ? at.b : at.a, false, at.points, count, begin, gradient);
  }
}

void FieldEngine::forward(const FieldPoints& points, FieldWorkspace& workspace, const FieldValues& values) const {
  const bool has_surface = has_any(values.rgb) || has_any(values.template_point);
  const auto kept = has_surface ? FieldWorkspace::Kept::kSurface : FieldWorkspace::Kept::kGeometry;
  const Scratch at = scratch(workspace);
  float* block = keep(workspace, kept, points.count);
  for (size_t begin = 0; begin < points.count; begin += kBlock, block += kept_rows(kept) * kBlock) {
    const size_t count = std::min(kBlock, points.count - begin);
    const Hidden hidden = geometry(block, false);
    gather(points, begin, kBlock, at.points);
    kernels_->encode(at.points, shape_.octaves, hidden.input);
    run_hidden(hidden);
    if (!has_surface) {
      run_distance(hidden, at.a);
      put(at.a, count, begin, values.distance);
      continue;
    }
    const Hidden colours = surface(block);
    run_output(shape_.geometry_layers, last_activations(hidden), colours.input);
    put(colours.input, count, begin, values.distance);
    // The encoding begins with the point itself.
    std::copy_n(hidden.input, 3 * kBlock, colours.input + size_t(1 + shape_.feature) * kBlock);
    run_hidden(colours);
    run_output(shape_.layers() - 1, last_activations(colours), at.a);
    for (size_t i = 0; i < 3; ++i) {
      put(at.a + i * kBlock, count, begin, values.rgb[i]);
      put(at.a + (3 + i) * kBlock, count, begin, values.template_point[i]);
    }
  }
  workspace.kept_ = kept;
}

void FieldEngine::forward_normals(const FieldPoints& points, FieldWorkspace& workspace, float* distance,
                                  const Planes& normal) const {
  constexpr size_t kWidth = kTangentPoints;
  const auto kept = FieldWorkspace::Kept::kTangents;
  const Scratch at = scratch(workspace);
  const float bias = packed_[layer(shape_.geometry_layers).bias];
  float* block = keep(workspace, kept, points.count);
  for (size_t begin = 0; begin < points.count; begin += kWidth, block += kept_rows(kept) * kBlock) {
    const size_t count = std::min(kWidth, points.count - begin);
    const Hidden hidden = geometry(block, true);
    gather(points, begin, kWidth, at.points);
    kernels_->encode_tangents(at.points, shape_.octaves, hidden.input);
    run_hidden(hidden);
    run_distance(hidden, at.a);
    for (size_t i = 0; i < kWidth; ++i) at.a[i] += bias;
    put(at.a, count, begin, distance);
    for (size_t axis = 0; axis < 3; ++axis) put(at.a + (1 + axis) * kWidth, count, begin, normal[axis]);
  }
  workspace.kept_ = kept;
}

// --- backwards
// --------------------------------------------------------------------------------------------------------

void FieldEngine::check_sums(const Sums& sums) const {
  if (sums.which == WeightGradient::kNone) return;
  if (sums.weights == nullptr || sums.weights->shape() != shape_) {
    throw Error(MAQ_ERROR_INTERNAL, "A gradient of a head's field is missing, or of another shape.");
  }
}

void FieldEngine::add_weight_gradient(const Sums& sums, int index, int outputs, const float* gradient,
                                      const float* in) const {
  if (sums.which == WeightGradient::kNone) return;
  if (sums.which == WeightGradient::kPersonal && !shape_.is_personal(index)) return;
  const FieldLayer to = sums.weights->layer(index);
  kernels_->weight_gradient(gradient, outputs, in, to.inputs, to.stride, sums.bias_columns, sums.transposed, to.weights,
                            to.bias);
}

float* FieldEngine::run_backward(const Hidden& hidden, const Sums& sums, float* gradient, float* other) const {
  const size_t size = size_t(hidden.rows) * kBlock;
  for (int i = hidden.layers - 1; i >= 0; --i) {
    const float* out = hidden.activations + size_t(i) * size;
    if (hidden.slopes == nullptr) {
      kernels_->activation_backward(out, hidden.rows, shape_.smoothing, gradient);
    } else {
      kernels_->activation_backward_tangents(hidden.slopes + size_t(i) * size, hidden.rows, gradient);
    }
    const int index = hidden.first_layer + i;
    add_weight_gradient(sums, index, hidden.rows, gradient, i == 0 ? hidden.input : out - size);
    if (i == 0) break;
    const Layer& at = layer(index);
    kernels_->multiply(packed_.data() + at.backward, at.inputs, at.outputs, at.outputs, gradient, other);
    std::swap(gradient, other);
  }
  return gradient;
}

void FieldEngine::put_points_gradient(const Hidden& geometry, const float* gradient, float* other, bool adds,
                                      float* points, size_t count, size_t begin, const Planes& points_gradient) const {
  const Layer& at = layer(0);
  kernels_->multiply(packed_.data() + at.backward, at.inputs, at.outputs, at.outputs, gradient, other);
  if (!adds) std::fill_n(points, 3 * kBlock, 0.0f);
  kernels_->encode_backward(geometry.input, other, shape_.octaves, points);
  for (size_t axis = 0; axis < 3; ++axis) put(points + axis * kBlock, count, begin, points_gradient[axis]);
}

void FieldEngine::backward(FieldWorkspace& workspace, const FieldValueGradient& gradient, WeightGradient which,
                           FieldWeights* weights, const Planes& points_gradient) const {
  const auto kept = workspace.kept_;
  if (kept != FieldWorkspace::Kept::kSurface && kept != FieldWorkspace::Kept::kGeometry) {
    throw Error(MAQ_ERROR_INTERNAL, "Nothing of a head's field was kept to go back from.");
  }
  const bool has_surface = has_any(gradient.rgb) || has_any(gradient.template_point);
  if (has_surface && kept != FieldWorkspace::Kept::kSurface) {
    throw Error(MAQ_ERROR_INTERNAL, "The surface network of a head's field was not run forwards.");
  }
  const Scratch at = scratch(workspace);
  const Sums sums{which, weights, at.transposed, kFieldBlock};
  check_sums(sums);
  const Layer& output = layer(shape_.geometry_layers);
  float* block = workspace.blocks_.data();
  for (size_t begin = 0; begin < workspace.count_; begin += kBlock, block += kept_rows(kept) * kBlock) {
    const size_t count = std::min(kBlock, workspace.count_ - begin);
    const Hidden hidden = geometry(block, false);
    float *here = at.a, *other = at.b;  // here: the gradient by what the output layer of the geometry gave
    int used = 1;
    if (has_surface) {
      const Hidden colours = surface(block);
      const Layer& last = layer(shape_.layers() - 1);
      for (size_t i = 0; i < 3; ++i) {
        take(gradient.rgb[i], begin, count, here + i * kBlock, kBlock);
        take(gradient.template_point[i], begin, count, here + (3 + i) * kBlock, kBlock);
      }
      add_weight_gradient(sums, shape_.layers() - 1, kSurfaceOutputs, here, last_activations(colours));
      kernels_->multiply(packed_.data() + last.backward, last.inputs, last.outputs, last.outputs, here, other);
      here = run_backward(colours, sums, other, here);
      other = here == at.a ? at.b : at.a;
      const Layer& first = layer(colours.first_layer);
      kernels_->multiply(packed_.data() + first.backward, first.inputs, first.outputs, first.outputs, here, other);
      std::swap(here, other);
      std::copy_n(here + size_t(1 + shape_.feature) * kBlock, 3 * kBlock, at.points);
      used = output.outputs;
      if (gradient.distance != nullptr) {
        for (size_t i = 0; i < count; ++i) here[i] += gradient.distance[begin + i];
      }
    } else {
      take(gradient.distance, begin, count, here, kBlock);
    }
    add_weight_gradient(sums, shape_.geometry_layers, used, here, last_activations(hidden));
    kernels_->multiply(packed_.data() + output.backward, output.inputs, output.outputs, used, here, other);
    here = run_backward(hidden, sums, other, here);
    other = here == at.a ? at.b : at.a;
    if (has_any(points_gradient)) {
      put_points_gradient(hidden, here, other, has_surface, at.points, count, begin, points_gradient);
    }
  }
}

void FieldEngine::backward_normals(FieldWorkspace& workspace, const float* distance_gradient,
                                   const ConstPlanes& normal_gradient, WeightGradient which,
                                   FieldWeights& weights) const {
  constexpr size_t kWidth = kTangentPoints;
  const auto kept = FieldWorkspace::Kept::kTangents;
  if (workspace.kept_ != kept) {
    throw Error(MAQ_ERROR_INTERNAL, "No normals of a head's field were kept to go back from.");
  }
  const Scratch at = scratch(workspace);
  const Sums sums{which, &weights, at.transposed, kTangentPoints};
  check_sums(sums);
  const Layer& output = layer(shape_.geometry_layers);
  float* block = workspace.blocks_.data();
  for (size_t begin = 0; begin < workspace.count_; begin += kWidth, block += kept_rows(kept) * kBlock) {
    const size_t count = std::min(kWidth, workspace.count_ - begin);
    const Hidden hidden = geometry(block, true);
    take(distance_gradient, begin, count, at.a, kWidth);
    for (size_t axis = 0; axis < 3; ++axis) {
      take(normal_gradient[axis], begin, count, at.a + (1 + axis) * kWidth, kWidth);
    }
    add_weight_gradient(sums, shape_.geometry_layers, 1, at.a, last_activations(hidden));
    kernels_->multiply(packed_.data() + output.backward, output.inputs, output.outputs, 1, at.a, at.b);
    run_backward(hidden, sums, at.b, at.a);
  }
}

double eikonal_loss(size_t count, const ConstPlanes& g, float scale, const Planes& gradient) {
  constexpr double kMax = std::numeric_limits<float>::max();
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    const double at[3] = {g[0][i], g[1][i], g[2][i]};
    const double norm = std::sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]);
    sum += (norm - 1) * (norm - 1);
    const double factor = norm > 0 ? 2 * (norm - 1) / norm * double(scale) : 0.0;
    for (size_t axis = 0; axis < 3; ++axis) gradient[axis][i] = float(std::clamp(factor * at[axis], -kMax, kMax));
  }
  return sum;
}

}  // namespace maq::head
