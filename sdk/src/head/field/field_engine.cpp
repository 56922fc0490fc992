#include "head/field/field_engine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"

namespace maq::head {
namespace {

constexpr size_t kBlock = kFieldBlock;

// The first `count` of a row, to the array from `begin` on; null: not wanted.
void put(const float* row, size_t begin, size_t count, float* to) {
  if (to != nullptr) std::copy_n(row, count, to + begin);
}

void put(const float* rows, size_t begin, size_t count, const Planes& to) {
  for (size_t i = 0; i < 3; ++i) put(rows + i * kBlock, begin, count, to[i]);
}

// From `begin` on, and zeros after them to the end of the row; null: zeros.
void take(const float* from, size_t begin, size_t count, float* row) {
  if (from == nullptr) count = 0;
  if (count > 0) std::copy_n(from + begin, count, row);
  std::fill(row + count, row + kBlock, 0.0f);
}

void take(const ConstPlanes& from, size_t begin, size_t count, float* rows) {
  for (size_t i = 0; i < 3; ++i) take(from[i], begin, count, rows + i * kBlock);
}

static_assert(kFieldBlock == 64, "points of a block are bits of a number");

// Finds points with a value that is not finite in some rows.
uint64_t not_finite(const float* rows, size_t row_count) {
  constexpr float kMax = std::numeric_limits<float>::max();
  int bad[kBlock] = {}, any = 0;
  for (size_t row = 0; row < row_count; ++row) {
    for (size_t i = 0; i < kBlock; ++i) bad[i] |= int(!(std::abs(rows[row * kBlock + i]) <= kMax));
  }
  for (const int is_bad : bad) any |= is_bad;
  uint64_t points = 0;
  for (size_t i = 0; any != 0 && i < kBlock; ++i) points |= uint64_t(bad[i]) << i;
  return points;
}

void clear(uint64_t points, float* rows, size_t row_count) {
  for (size_t i = 0; points != 0; ++i, points >>= 1) {
    if ((points & 1) == 0) continue;
    for (size_t row = 0; row < row_count; ++row) rows[row * kBlock + i] = 0;
  }
}

size_t count_of(uint64_t points) {
  size_t count = 0;
  for (; points != 0; points &= points - 1) ++count;
  return count;
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
    const size_t size = size_t(next.inputs) * size_t(next.outputs);
    next.forward = end;
    next.backward = end + size;
    next.bias = end + 2 * size;
    end = next.bias + size_t(next.outputs);
    max_rows_ = std::max({max_rows_, size_t(next.inputs), size_t(next.outputs)});
    max_stride_ = std::max(max_stride_, places[size_t(index)].stride);
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

// --- memory ----------------------------------------------------------------------------------------------------------

FieldEngine::Scratch FieldEngine::scratch(FieldWorkspace& workspace) const {
  const size_t rows = max_rows_ * kBlock, points = 3 * kBlock;
  const size_t size = 2 * rows + max_stride_ * kBlock + points;
  if (workspace.scratch_.size() < size) workspace.scratch_.resize(size);
  Scratch at{};
  float* next = workspace.scratch_.data();
  const auto give = [&next](size_t floats) { return std::exchange(next, next + floats); };
  at.a = give(rows);
  at.b = give(rows);
  at.transposed = give(max_stride_ * kBlock);
  at.points = give(points);
  return at;
}

size_t FieldEngine::kept_rows(bool has_surface) const {
  size_t rows = size_t(shape_.encoding()) + size_t(shape_.geometry_layers) * size_t(shape_.width);
  if (has_surface) {
    rows += size_t(shape_.surface_inputs()) + size_t(shape_.surface_layers) * size_t(shape_.surface_width);
  }
  return rows;
}

void FieldEngine::keep(FieldWorkspace& workspace, size_t count, bool has_surface) const {
  workspace.is_kept_ = false;
  const size_t size = (count + kBlock - 1) / kBlock * kept_rows(has_surface) * kBlock;
  if (workspace.blocks_.size() < size) workspace.blocks_.resize(size);
  workspace.left_out_.assign((count + kBlock - 1) / kBlock, 0);
  workspace.count_ = count;
  workspace.has_surface_ = has_surface;
}

FieldEngine::Block FieldEngine::block(FieldWorkspace& workspace, size_t begin) const {
  const size_t rows = kept_rows(workspace.has_surface_);
  const size_t hidden_rows = size_t(shape_.geometry_layers) * size_t(shape_.width);
  Block at{};
  at.encoding = workspace.blocks_.data() + begin * rows;
  at.geometry = at.encoding + size_t(shape_.encoding()) * kBlock;
  if (workspace.has_surface_) {
    at.surface_input = at.geometry + hidden_rows * kBlock;
    at.surface = at.surface_input + size_t(shape_.surface_inputs()) * kBlock;
  }
  return at;
}

// --- forwards --------------------------------------------------------------------------------------------------------

void FieldEngine::run_activated(int index, const float* in, float* out) const {
  const Layer& at = layer(index);
  kernels_->affine_activated(packed_.data() + at.forward, packed_.data() + at.bias, at.outputs, at.inputs,
                             shape_.smoothing, in, out);
}

void FieldEngine::run_affine(int index, const float* in, float* out) const {
  const Layer& at = layer(index);
  kernels_->affine(packed_.data() + at.forward, packed_.data() + at.bias, at.outputs, at.inputs, in, out);
}

void FieldEngine::run_transposed(int index, int used, const float* gradient, float* out) const {
  const Layer& at = layer(index);
  kernels_->multiply(packed_.data() + at.backward, at.inputs, at.outputs, used, gradient, out);
}

void FieldEngine::run_geometry(const Block& at) const {
  const float* in = at.encoding;
  for (int i = 0; i < shape_.geometry_layers; ++i) {
    float* out = hidden(at.geometry, i);
    run_activated(i, in, out);
    in = out;
  }
}

void FieldEngine::run_distance(const Block& at, float* out) const {
  const int index = shape_.geometry_layers;
  kernels_->affine(packed_.data() + distance_row_, packed_.data() + layer(index).bias, 1, shape_.width,
                   hidden(at.geometry, index - 1), out);
}

void FieldEngine::run_surface(const Block& at, float* out) const {
  run_affine(shape_.geometry_layers, hidden(at.geometry, shape_.geometry_layers - 1), at.surface_input);
  // The encoding begins with the point itself.
  std::copy_n(at.encoding, 3 * kBlock, at.surface_input + size_t(1 + shape_.feature) * kBlock);
  const float* in = at.surface_input;
  for (int i = 0; i < shape_.surface_layers; ++i) {
    float* to = surface_hidden(at.surface, i);
    run_activated(shape_.first_surface_layer() + i, in, to);
    in = to;
  }
  run_affine(shape_.layers() - 1, in, out);
}

// The gradient of the distance by the point (scratch.points).
void FieldEngine::run_slopes(const Block& at, const Scratch& scratch) const {
  std::fill_n(scratch.a, kBlock, 1.0f);
  run_transposed(shape_.geometry_layers, 1, scratch.a, scratch.b);
  for (int i = shape_.geometry_layers - 1; i >= 0; --i) {
    kernels_->activation_backward(hidden(at.geometry, i), shape_.width, shape_.smoothing, scratch.b, scratch.a);
    run_transposed(i, shape_.width, scratch.a, scratch.b);
  }
  std::fill_n(scratch.points, 3 * kBlock, 0.0f);
  kernels_->encode_backward(at.encoding, scratch.b, shape_.octaves, scratch.points);
}

void FieldEngine::distances(const FieldPoints& points, FieldWorkspace& workspace, float* distance,
                            const Planes& gradient) const {
  const bool has_gradient = has_any(gradient);
  const Scratch memory = scratch(workspace);
  keep(workspace, std::min(points.count, kBlock), false);
  const Block at = block(workspace, 0);
  for (size_t begin = 0; begin < points.count; begin += kBlock) {
    const size_t count = std::min(kBlock, points.count - begin);
    take({points.x, points.y, points.z}, begin, count, memory.points);
    kernels_->encode(memory.points, shape_.octaves, at.encoding);
    run_geometry(at);
    run_distance(at, memory.a);
    put(memory.a, begin, count, distance);
    if (!has_gradient) continue;
    run_slopes(at, memory);
    put(memory.points, begin, count, gradient);
  }
}

void FieldEngine::forward(const FieldPoints& points, FieldWorkspace& workspace, const FieldValues& values) const {
  const bool has_surface = has_any(values.rgb) || has_any(values.template_point);
  const bool has_normals = has_any(values.normal);
  const Scratch memory = scratch(workspace);
  keep(workspace, points.count, has_surface);
  for (size_t begin = 0; begin < points.count; begin += kBlock) {
    const size_t count = std::min(kBlock, points.count - begin);
    const Block at = block(workspace, begin);
    take({points.x, points.y, points.z}, begin, count, memory.points);
    kernels_->encode(memory.points, shape_.octaves, at.encoding);
    run_geometry(at);
    uint64_t& left_out = workspace.left_out_[begin / kBlock];
    if (has_surface) {
      run_surface(at, memory.a);
      left_out = not_finite(at.surface_input, 1) | not_finite(memory.a, kSurfaceOutputs);
      put(at.surface_input, begin, count, values.distance);
      put(memory.a, begin, count, values.rgb);
      put(memory.a + 3 * kBlock, begin, count, values.template_point);
    } else {
      run_distance(at, memory.a);
      left_out = not_finite(memory.a, 1);
      put(memory.a, begin, count, values.distance);
    }
    if (has_normals) {
      run_slopes(at, memory);
      left_out |= not_finite(memory.points, 3);
      put(memory.points, begin, count, values.normal);
    }
    // A gradient of 0 times a kept value is then 0.
    clear(left_out, at.encoding, kept_rows(has_surface));
  }
  workspace.is_kept_ = true;
}

// --- backwards -------------------------------------------------------------------------------------------------------

void FieldEngine::check_backward(const FieldWorkspace& workspace, const FieldValueGradient& gradient,
                                 const Sums& sums) const {
  if (!workspace.is_kept_) {
    throw Error(MAQ_ERROR_INTERNAL, "Nothing of a head's field was kept to go back from.");
  }
  if (!workspace.has_surface_ && (has_any(gradient.rgb) || has_any(gradient.template_point))) {
    throw Error(MAQ_ERROR_INTERNAL, "The surface network of a head's field was not run forwards.");
  }
  if (sums.which != WeightGradient::kNone && (sums.weights == nullptr || sums.weights->shape() != shape_)) {
    throw Error(MAQ_ERROR_INTERNAL, "A gradient of a head's field is missing, or of another shape.");
  }
}

bool FieldEngine::wants(const Sums& sums, int index) const {
  const bool is_surface = index >= shape_.first_surface_layer();
  switch (sums.which) {
    case WeightGradient::kNone: return false;
    case WeightGradient::kPersonal: return shape_.is_personal(index);
    case WeightGradient::kPersonalGeometry: return !is_surface && shape_.is_personal(index);
    case WeightGradient::kPersonalSurface: return is_surface && shape_.is_personal(index);
    case WeightGradient::kAll: return true;
  }
  return false;
}

void FieldEngine::add_weight_gradient(const Sums& sums, int index, int outputs, const float* gradient,
                                      const float* in) const {
  if (!wants(sums, index)) return;
  const FieldLayer to = sums.weights->layer(index);
  kernels_->weight_gradient(gradient, outputs, in, to.inputs, to.stride, sums.transposed, to.weights, to.bias);
}

void FieldEngine::surface_backward(const Block& at, const Sums& sums, Scratch& scratch) const {
  const int last = shape_.surface_layers - 1, rows = shape_.surface_width;
  add_weight_gradient(sums, shape_.layers() - 1, kSurfaceOutputs, scratch.a, surface_hidden(at.surface, last));
  run_transposed(shape_.layers() - 1, kSurfaceOutputs, scratch.a, scratch.b);
  std::swap(scratch.a, scratch.b);
  for (int i = last; i >= 0; --i) {
    const int index = shape_.first_surface_layer() + i;
    kernels_->activation_backward(surface_hidden(at.surface, i), rows, shape_.smoothing, scratch.a, scratch.a);
    add_weight_gradient(sums, index, rows, scratch.a, i > 0 ? surface_hidden(at.surface, i - 1) : at.surface_input);
    run_transposed(index, rows, scratch.a, scratch.b);
    std::swap(scratch.a, scratch.b);
  }
}

void FieldEngine::geometry_backward(const Block& at, const Sums& sums, int used, bool to_input,
                                    Scratch& scratch) const {
  const int last = shape_.geometry_layers - 1, rows = shape_.width;
  add_weight_gradient(sums, last + 1, used, scratch.a, hidden(at.geometry, last));
  run_transposed(last + 1, used, scratch.a, scratch.b);
  std::swap(scratch.a, scratch.b);
  for (int i = last; i >= 0; --i) {
    kernels_->activation_backward(hidden(at.geometry, i), rows, shape_.smoothing, scratch.a, scratch.a);
    add_weight_gradient(sums, i, rows, scratch.a, i > 0 ? hidden(at.geometry, i - 1) : at.encoding);
    if (i == 0 && !to_input) break;
    run_transposed(i, rows, scratch.a, scratch.b);
    std::swap(scratch.a, scratch.b);
  }
}

size_t FieldEngine::backward(FieldWorkspace& workspace, const FieldValueGradient& gradient, WeightGradient which,
                             FieldWeights* weights, const Planes& points_gradient) const {
  const bool has_surface = has_any(gradient.rgb) || has_any(gradient.template_point);
  const bool to_points = has_any(points_gradient);
  Scratch memory = scratch(workspace);
  const Sums sums{which, weights, memory.transposed};
  check_backward(workspace, gradient, sums);
  size_t all_left_out = 0;
  for (size_t begin = 0; begin < workspace.count_; begin += kBlock) {
    const size_t count = std::min(kBlock, workspace.count_ - begin);
    const Block at = block(workspace, begin);
    int used = 1;
    uint64_t left_out = workspace.left_out_[begin / kBlock];
    std::array<float, kBlock> by_distance;
    take(gradient.distance, begin, count, by_distance.data());
    left_out |= not_finite(by_distance.data(), 1);
    if (has_surface) {
      take(gradient.rgb, begin, count, memory.a);
      take(gradient.template_point, begin, count, memory.a + 3 * kBlock);
      left_out |= not_finite(memory.a, kSurfaceOutputs);
      clear(left_out, memory.a, kSurfaceOutputs);
    }
    clear(left_out, by_distance.data(), 1);
    all_left_out += count_of(left_out);
    std::fill_n(memory.points, 3 * kBlock, 0.0f);
    if (has_surface) {
      surface_backward(at, sums, memory);
      used = 1 + shape_.feature;
      std::copy_n(memory.a + size_t(used) * kBlock, 3 * kBlock, memory.points);
      for (size_t i = 0; i < kBlock; ++i) memory.a[i] += by_distance[i];
    } else {
      std::copy(by_distance.begin(), by_distance.end(), memory.a);
    }
    if (which == WeightGradient::kPersonalSurface && !to_points) continue;
    geometry_backward(at, sums, used, to_points, memory);
    if (!to_points) continue;
    kernels_->encode_backward(at.encoding, memory.a, shape_.octaves, memory.points);
    put(memory.points, begin, count, points_gradient);
  }
  return all_left_out;
}

}  // namespace maq::head
