#include "prediction/flow/packed_flow.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr int kNone = 32768;  // a displacement of 0

// Inlined they would be there once for each direction.
[[gnu::noinline]] float largest_of(const float* __restrict values, size_t count, float largest) {
  for (size_t i = 0; i < count; ++i) largest = std::max(largest, std::abs(values[i]));
  return largest;
}

[[gnu::noinline]] void pack_values(const float* __restrict values, size_t count, float factor,
                                   uint16_t* __restrict packed) {
  for (size_t i = 0; i < count; ++i) packed[i] = uint16_t(int(values[i] * factor + (float(kNone) + 0.5f)));
}

[[gnu::noinline]] void unpack_values(const uint16_t* __restrict packed, size_t count, float step,
                                     float* __restrict values) {
  for (size_t i = 0; i < count; ++i) values[i] = float(int(packed[i]) - kNone) * step;
}

}  // namespace

bool PackedFlow::pack(const FlowField& flow) {
  width_px_ = flow.width_px;
  height_px_ = flow.height_px;
  const size_t count = flow.dx_px.size();
  packed_.resize(2 * count);
  const float largest = largest_of(flow.dy_px.data(), count, largest_of(flow.dx_px.data(), count, 0));
  step_px_ = largest / float(kNone - 1);
  // Displacements become 0 if the step is 0 or its inverse is infinite.
  const float factor = step_px_ > 1e-30f ? 1 / step_px_ : 0;
  pack_values(flow.dx_px.data(), count, factor, packed_.data());
  pack_values(flow.dy_px.data(), count, factor, packed_.data() + count);
  return largest > 0;
}

void PackedFlow::unpack(FlowField& flow) const {
  flow.resize(width_px_, height_px_);
  const size_t count = packed_.size() / 2;
  unpack_values(packed_.data(), count, step_px_, flow.dx_px.data());
  unpack_values(packed_.data() + count, count, step_px_, flow.dy_px.data());
}

}  // namespace maq
