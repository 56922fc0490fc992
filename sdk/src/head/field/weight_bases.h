// A head's weights as linear combinations: W = W0 + sum over k of code k times basis k, in the personal layers.
#pragma once

#include <vector>

#include "head/field/field_isa.h"
#include "head/field/field_weights.h"

namespace maq::head {

inline constexpr int kMaxFieldCodes = 512;

// The coefficients of a head, or the gradient by them.
struct FieldCodes {
  std::vector<float> shape;   // of the personal geometry layers
  std::vector<float> colour;  // of the personal surface layers
};

class WeightBases {
 public:
  // All 0. Throws as check_field_shape() does, and MAQ_ERROR_UNSUPPORTED for counts of codes beyond 0 to
  // kMaxFieldCodes.
  WeightBases(const FieldShape& shape, int shape_codes, int colour_codes, FieldIsa isa = fastest_field_isa());

  const FieldShape& shape() const { return constant_.shape(); }
  int shape_codes() const { return geometry_.codes; }
  int colour_codes() const { return surface_.codes; }

  // W0, and all layers that are not personal.
  FieldWeights& constant() { return constant_; }
  const FieldWeights& constant() const { return constant_; }
  // The change of a personal layer for one unit of `code`. Throws MAQ_ERROR_INTERNAL for another layer, or a code that
  // is too high.
  FieldLayer basis_layer(int layer, int code);

  // W0 and all bases are finite numbers.
  bool is_finite() const;

  // Throws MAQ_ERROR_INVALID_ARGUMENT unless there are as many codes as bases, all of them finite numbers. `weights`
  // must have the shape of the bases (MAQ_ERROR_INTERNAL), and does not allocate.
  void combine(const FieldCodes& codes, FieldWeights& weights) const;
  FieldWeights combine(const FieldCodes& codes) const;

  // Bases of the same heads by other codes u: shape codes are mean + L u, colour codes mean + u. `factor`: L, lower
  // triangle, row by row. Throws as combine() does, and MAQ_ERROR_INTERNAL for a factor of another size.
  WeightBases moved(const FieldCodes& mean, const std::vector<float>& factor) const;

  // By the gradient of a loss by the weights, that by the codes.
  void code_gradient(const FieldWeights& weight_gradient, FieldCodes& codes) const;

 private:
  // Bases of neighbouring layers: [codes][count], laid out as the layers are in FieldWeights from `begin` on.
  struct Bases {
    int first_layer = 0, layers = 0, codes = 0;
    size_t begin = 0, count = 0;
    AlignedFloats values;
  };
  Bases make_bases(int first_layer, int layers, int codes) const;
  void add_codes(const Bases& bases, const std::vector<float>& codes, FieldWeights& weights) const;

  const FieldKernels* kernels_;
  FieldWeights constant_;
  Bases geometry_, surface_;
};

}  // namespace maq::head
