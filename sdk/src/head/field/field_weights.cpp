#include "head/field/field_weights.h"

#include <algorithm>

#include "core/error.h"

namespace maq::head {
namespace {

size_t padded(size_t size, size_t to) { return (size + to - 1) / to * to; }

}  // namespace

std::vector<FieldLayerPlace> field_layer_places(const FieldShape& shape) {
  check_field_shape(shape);
  std::vector<FieldLayerPlace> places;
  size_t end = 0;
  for (int layer = 0; layer < shape.layers(); ++layer) {
    FieldLayerPlace place;
    place.weights = end;
    place.stride = padded(size_t(shape.inputs(layer)), kFieldRowPadding);
    place.bias = end + size_t(shape.outputs(layer)) * place.stride;
    end = padded(place.bias + size_t(shape.outputs(layer)), 64);
    place.end = end;
    places.push_back(place);
  }
  return places;
}

FieldWeights::FieldWeights(const FieldShape& shape)
    : shape_(shape), places_(field_layer_places(shape)), values_(places_.back().end, 0.0f) {}

void FieldWeights::set_zero() { std::fill(values_.begin(), values_.end(), 0.0f); }

void FieldWeights::add(const FieldWeights& other) {
  if (shape_ != other.shape_) throw Error(MAQ_ERROR_INTERNAL, "Weights of two shapes of field were to be added.");
  for (size_t i = 0; i < values_.size(); ++i) values_[i] += other.values_[i];
}

}  // namespace maq::head
