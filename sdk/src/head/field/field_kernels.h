// The vector computations of the field engine, once for each instruction set. The sources that define them are compiled
// with their own flags. They include no header with functions that other sources could use: plain numbers only.
//
// Points lie in blocks of kFieldBlock columns: a matrix [rows][kFieldBlock] has a row for each input or output of a
// layer. All memory is aligned to 64 bytes.
#pragma once

#include <cstddef>

namespace maq::head {

inline constexpr int kFieldBlock = 64;

struct FieldKernels {
  // points: [3][kFieldBlock] -> encoding [3 + 6 octaves][kFieldBlock], sines and cosines within 2e-7 for angles up to
  // 2,000. A point that is not finite is NaN in all rows that depend on it.
  void (*encode)(const float* points, int octaves, float* encoding);
  // Adds the gradient by the points, from that by the encoding: [3][kFieldBlock].
  void (*encode_backward)(const float* encoding, const float* gradient, int octaves, float* points_gradient);

  // Weights [rows][stride], of which `depth` columns, in the order of multiply(): rows * depth floats.
  void (*pack)(const float* weights, size_t stride, int rows, int depth, float* packed);
  // The same of the transpose of weights [depth][stride]: rows * depth floats.
  void (*pack_transposed)(const float* weights, size_t stride, int rows, int depth, float* packed);
  // out [rows][block] = packed [rows][depth] · in [depth][block], of which the first `used` of the depth.
  void (*multiply)(const float* packed, int rows, int depth, int used, const float* in, float* out);
  // The same, of the whole depth, plus bias [rows] in each column.
  void (*affine)(const float* packed, const float* bias, int rows, int depth, const float* in, float* out);
  // The same through squareplus.
  void (*affine_activated)(const float* packed, const float* bias, int rows, int depth, float smoothing,
                           const float* in, float* out);

  // The gradient by the input of squareplus, from its output (out) and the gradient by the output.
  void (*activation_backward)(const float* out, int rows, float smoothing, const float* gradient, float* result);
  // Adds gradient [outputs][block] · transpose of in [inputs][block] to weights [outputs][stride], and the sums of
  // gradient's rows to bias, unless that is null. scratch: kFieldBlock * stride floats.
  void (*weight_gradient)(const float* gradient, int outputs, const float* in, int inputs, size_t stride,
                          float* scratch, float* weights, float* bias);

  // Arrays of `count` floats, a multiple of 64: out = constant + Σ codes[k] bases[k]; the dot product of two.
  void (*combine)(const float* constant, const float* bases, const float* codes, int codes_count, size_t count,
                  float* out);
  float (*dot)(const float* a, const float* b, size_t count);
};

const FieldKernels& field_kernels_portable();
#if defined(__x86_64__)
const FieldKernels& field_kernels_avx2();
const FieldKernels& field_kernels_avx512();
#endif

}  // namespace maq::head
