// The weights of one head's field network, or their gradient: one array of float32.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

#include "head/field/field_shape.h"

namespace maq::head {

// As the widest vectors want their memory.
template <class T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};

  CacheLineAllocator() = default;
  template <class U>
  CacheLineAllocator(const CacheLineAllocator<U>&) {}
  T* allocate(size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kAlignment)); }
  void deallocate(T* memory, size_t) { ::operator delete(memory, kAlignment); }
  bool operator==(const CacheLineAllocator&) const { return true; }
  bool operator!=(const CacheLineAllocator&) const { return false; }
};
using AlignedFloats = std::vector<float, CacheLineAllocator<float>>;

// One layer within the array: out = weights · in + bias.
template <class T>
struct FieldLayerOf {
  T* weights;     // [outputs][stride], of which [outputs][inputs] are used and the rest is 0
  T* bias;        // [outputs]
  size_t stride;  // inputs, padded
  int inputs, outputs;

  T* row(int output) const { return weights + size_t(output) * stride; }
};
using FieldLayer = FieldLayerOf<float>;
using ConstFieldLayer = FieldLayerOf<const float>;

// Where a layer lies, in floats.
struct FieldLayerPlace {
  size_t weights, bias, stride, end;
};
// Returns the offsets of all layers, one after the other from 0 on; each ends at a multiple of 64. Throws as
// check_field_shape() does.
std::vector<FieldLayerPlace> field_layer_places(const FieldShape& shape);

class FieldWeights {
 public:
  // All 0. Throws as check_field_shape() does.
  explicit FieldWeights(const FieldShape& shape);

  const FieldShape& shape() const { return shape_; }
  FieldLayer layer(int index) { return layer_of<float>(values_.data(), index); }
  ConstFieldLayer layer(int index) const { return layer_of<const float>(values_.data(), index); }

  // Everything, padding (which stays 0) included; of a multiple of 64 floats.
  AlignedFloats& values() { return values_; }
  const AlignedFloats& values() const { return values_; }
  const FieldLayerPlace& place(int index) const { return places_[size_t(index)]; }

  void set_zero();
  // Throws MAQ_ERROR_INTERNAL unless both have the same shape.
  void add(const FieldWeights& other);

 private:
  template <class T>
  FieldLayerOf<T> layer_of(T* values, int index) const {
    const FieldLayerPlace& place = places_[size_t(index)];
    return {values + place.weights, values + place.bias, place.stride, shape_.inputs(index), shape_.outputs(index)};
  }

  FieldShape shape_;
  std::vector<FieldLayerPlace> places_;
  AlignedFloats values_;
};

}  // namespace maq::head
