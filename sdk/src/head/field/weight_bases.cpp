#include "head/field/weight_bases.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/math/finite.h"

namespace maq::head {
namespace {

void check_codes(const char* name, const std::vector<float>& codes, int expected) {
  if (codes.size() != size_t(expected)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "There are ", codes.size(), " ", name, " codes of a head, but ", expected,
                " bases. Use codes that were made with the same bundle.");
  }
  if (!are_finite(codes.data(), codes.size())) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "One of the ", name, " codes of a head is not a finite number.");
  }
}

}  // namespace

WeightBases::WeightBases(const FieldShape& shape, int shape_codes, int colour_codes, FieldIsa isa)
    : kernels_(&field_kernels(isa)), constant_(shape) {
  geometry_ = make_bases(0, shape.personal_geometry_layers, shape_codes);
  surface_ = make_bases(shape.first_surface_layer(), shape.personal_surface_layers, colour_codes);
}

WeightBases::Bases WeightBases::make_bases(int first_layer, int layers, int codes) const {
  if (codes < 0 || codes > kMaxFieldCodes) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "A head has ", codes, " codes, but must have 0 to ", kMaxFieldCodes, ".");
  }
  Bases bases;
  bases.first_layer = first_layer;
  bases.layers = layers;
  bases.codes = codes;
  if (layers > 0) {
    bases.begin = constant_.place(first_layer).weights;
    bases.count = constant_.place(first_layer + layers - 1).end - bases.begin;
  }
  bases.values.assign(size_t(codes) * bases.count, 0.0f);
  return bases;
}

FieldLayer WeightBases::basis_layer(int layer, int code) {
  for (Bases* bases : {&geometry_, &surface_}) {
    const int within = layer - bases->first_layer;
    if (within < 0 || within >= bases->layers || code < 0 || code >= bases->codes) continue;
    float* values = bases->values.data() + size_t(code) * bases->count;
    const FieldLayerPlace& place = constant_.place(layer);
    return {values + (place.weights - bases->begin), values + (place.bias - bases->begin), place.stride,
            shape().inputs(layer), shape().outputs(layer)};
  }
  throw Error(MAQ_ERROR_INTERNAL, "Layer ", layer, " of a head's field has no basis ", code, ".");
}

bool WeightBases::is_finite() const {
  return are_finite(constant_.values().data(), constant_.values().size()) &&
         are_finite(geometry_.values.data(), geometry_.values.size()) &&
         are_finite(surface_.values.data(), surface_.values.size());
}

void WeightBases::combine(const FieldCodes& codes, FieldWeights& weights) const {
  check_codes("shape", codes.shape, geometry_.codes);
  check_codes("colour", codes.colour, surface_.codes);
  if (weights.shape() != shape()) throw Error(MAQ_ERROR_INTERNAL, "Weights and bases are of two shapes of field.");
  std::copy(constant_.values().begin(), constant_.values().end(), weights.values().begin());
  add_codes(geometry_, codes.shape, weights);
  add_codes(surface_, codes.colour, weights);
}

FieldWeights WeightBases::combine(const FieldCodes& codes) const {
  FieldWeights weights(shape());
  combine(codes, weights);
  return weights;
}

void WeightBases::add_codes(const Bases& bases, const std::vector<float>& codes, FieldWeights& weights) const {
  kernels_->combine(constant_.values().data() + bases.begin, bases.values.data(), codes.data(), bases.codes,
                    bases.count, weights.values().data() + bases.begin);
}

WeightBases WeightBases::moved(const FieldCodes& mean, const std::vector<float>& factor) const {
  WeightBases made = *this;
  combine(mean, made.constant_);
  const auto codes = size_t(geometry_.codes);
  if (factor.size() != codes * (codes + 1) / 2) {
    throw Error(MAQ_ERROR_INTERNAL, "The factor of ", codes, " shape codes has ", factor.size(), " numbers.");
  }
  std::fill(made.geometry_.values.begin(), made.geometry_.values.end(), 0.0f);
  const float* weight = factor.data();
  for (size_t row = 0; row < codes; ++row) {
    const float* const from = geometry_.values.data() + row * geometry_.count;
    for (size_t column = 0; column <= row; ++column, ++weight) {
      float* const to = made.geometry_.values.data() + column * geometry_.count;
      for (size_t i = 0; i < geometry_.count; ++i) to[i] += *weight * from[i];
    }
  }
  return made;
}

void WeightBases::code_gradient(const FieldWeights& weight_gradient, FieldCodes& codes) const {
  if (weight_gradient.shape() != shape()) {
    throw Error(MAQ_ERROR_INTERNAL, "A gradient and bases are of two shapes of field.");
  }
  const auto dot_all = [&](const Bases& bases, std::vector<float>& result) {
    result.resize(size_t(bases.codes));
    const float* gradient = weight_gradient.values().data() + bases.begin;
    for (int k = 0; k < bases.codes; ++k) {
      result[size_t(k)] = kernels_->dot(bases.values.data() + size_t(k) * bases.count, gradient, bases.count);
    }
  };
  dot_all(geometry_, codes.shape);
  dot_all(surface_, codes.colour);
}

}  // namespace maq::head
