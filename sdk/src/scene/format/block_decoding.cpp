#include "scene/format/block_decoding.h"

#include <type_traits>

#include "scene/format/scene_layout.h"

namespace maq {
namespace {

// `numbers` of `columns` a row, each with its own middle and step; `middle` may be null.
template <class Stored>
void decode(const void* array, size_t first, size_t rows, size_t columns, const float* middle, const float* step,
            float* numbers) {
  const Stored* stored = static_cast<const Stored*>(array) + first;
  for (size_t i = 0; i < rows * columns; ++i) {
    const size_t c = i % columns;
    numbers[i] = std::is_same_v<Stored, float> ? float(stored[i])
                                               : (middle == nullptr ? 0 : middle[c]) + float(stored[i]) * step[c];
  }
}

}  // namespace

ModelledPoints unpack_block(const Scene& scene, const SceneBlock& block) {
  ModelledPoints points;
  points.origin = scene.origin;
  points.up = scene.up;
  std::vector<float>* const axes[3] = {&points.x, &points.y, &points.z};
  for (size_t axis = 0; axis < 3; ++axis) {
    axes[axis]->resize(block.count);
    const auto decode_axis = scene.place_kind == Places::kFloat32 ? decode<float> : decode<uint16_t>;
    decode_axis(scene.places, 3 * size_t(block.first) + axis * block.count, block.count, 1, &block.low[axis],
                &block.place_step[axis], axes[axis]->data());
  }
  points.means.resize(size_t(block.count) * kFeatures);
  points.slopes.resize(size_t(block.count) * kSlopes);
  const auto decode_looks = scene.coefficient_kind == Coefficients::kFloat32 ? decode<float>
                            : scene.coefficient_kind == Coefficients::kInt16 ? decode<int16_t>
                                                                             : decode<int8_t>;
  decode_looks(scene.means, size_t(block.first) * kFeatures, block.count, kFeatures, block.mean_middle, block.mean_step,
               points.means.data());
  decode_looks(scene.slopes, size_t(block.first_varying) * kSlopes, block.varying, kSlopes, nullptr, block.slope_step,
               points.slopes.data());
  return points;
}

}  // namespace maq
