// The kernels, for whatever instruction set the including source is compiled for; it gives the name of the function
// that returns them as MAQ_FIELD_KERNELS. Everything is in an anonymous namespace, or the linker could give code for
// AVX-512 to all.

#include <cstdint>

#include "head/field/field_kernels.h"

#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

#if defined(__clang__)
#define MAQ_UNROLL _Pragma("unroll")
#else
#define MAQ_UNROLL _Pragma("GCC unroll 16")
#endif

namespace maq::head {
namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 16, kTileRows = 8;
#elif defined(__AVX2__) && defined(__FMA__)
constexpr int kLanes = 8, kTileRows = 6;
#elif defined(__aarch64__)
constexpr int kLanes = 4, kTileRows = 8;
#else
constexpr int kLanes = 4, kTileRows = 4;
#endif
constexpr int kTileVectors = 2;

typedef float Vector __attribute__((vector_size(kLanes * 4), may_alias));
typedef int32_t Mask __attribute__((vector_size(kLanes * 4), may_alias));
typedef float Four __attribute__((vector_size(16), may_alias));
typedef int32_t FourIndices __attribute__((vector_size(16)));

inline Vector load(const float* from) { return *reinterpret_cast<const Vector*>(from); }
inline void store(float* to, Vector value) { *reinterpret_cast<Vector*>(to) = value; }
inline Vector broadcast(float value) { return value - Vector{}; }

// a b + c
#if defined(__AVX512F__)
inline Vector multiply_add(Vector a, Vector b, Vector c) { return Vector(_mm512_fmadd_ps(a, b, c)); }
// The unmasked one takes an uninitialised value in GCC's header, which -Wuninitialized finds.
inline Vector square_root(Vector a) { return Vector(_mm512_maskz_sqrt_ps(0xffff, a)); }
#elif defined(__AVX2__) && defined(__FMA__)
inline Vector multiply_add(Vector a, Vector b, Vector c) { return Vector(_mm256_fmadd_ps(a, b, c)); }
inline Vector square_root(Vector a) { return Vector(_mm256_sqrt_ps(a)); }
#elif defined(__aarch64__)
inline Vector multiply_add(Vector a, Vector b, Vector c) {
  return Vector(vfmaq_f32(float32x4_t(c), float32x4_t(a), float32x4_t(b)));
}
inline Vector square_root(Vector a) { return Vector(vsqrtq_f32(float32x4_t(a))); }
#else
inline Vector multiply_add(Vector a, Vector b, Vector c) { return a * b + c; }
#if defined(__SSE2__)
inline Vector square_root(Vector a) { return Vector(_mm_sqrt_ps(a)); }
#else
inline Vector square_root(Vector a) {
  for (int i = 0; i < kLanes; ++i) a[i] = __builtin_sqrtf(a[i]);
  return a;
}
#endif
#endif

inline Vector squareplus(Vector v, Vector smoothing) {
  return (v + square_root(multiply_add(v, v, smoothing))) * broadcast(0.5f);
}

// --- products of matrices --------------------------------------------------------------------------------------------

enum class From { kZero, kBias, kSum };

// Rows by kTileVectors vectors of c = a b, or the variant of From: all of it in registers. a's row r at depth k is a[r
// * row_step + k * depth_step].
template <int kRows, int kVectors, int kRowStep, int kDepthStep, From kFrom, bool kActivated>
inline __attribute__((always_inline)) void tile(const float* a, int depth, const float* b, size_t b_stride,
                                                const float* bias, float* c, size_t c_stride, float smoothing) {
  Vector sum[kRows][kVectors];
  MAQ_UNROLL for (int r = 0; r < kRows; ++r) {
    MAQ_UNROLL for (int v = 0; v < kVectors; ++v) {
      if constexpr (kFrom == From::kSum) {
        sum[r][v] = load(c + size_t(r) * c_stride + v * kLanes);
      } else {
        sum[r][v] = broadcast(kFrom == From::kBias ? bias[r] : 0.0f);
      }
    }
  }
  for (int k = 0; k < depth; ++k) {
    Vector column[kVectors];
    MAQ_UNROLL for (int v = 0; v < kVectors; ++v) column[v] = load(b + v * kLanes);
    MAQ_UNROLL for (int r = 0; r < kRows; ++r) {
      const Vector factor = broadcast(a[r * kRowStep]);
      MAQ_UNROLL for (int v = 0; v < kVectors; ++v) sum[r][v] = multiply_add(factor, column[v], sum[r][v]);
    }
    a += kDepthStep;
    b += b_stride;
  }
  const Vector smooth = broadcast(smoothing);
  MAQ_UNROLL for (int r = 0; r < kRows; ++r) {
    MAQ_UNROLL for (int v = 0; v < kVectors; ++v) {
      if constexpr (kActivated) sum[r][v] = squareplus(sum[r][v], smooth);
      store(c + size_t(r) * c_stride + v * kLanes, sum[r][v]);
    }
  }
}

// How many rows the next tile has, where so many are left.
constexpr int tile_rows(int left) { return left >= kTileRows ? kTileRows : left >= 4 ? 4 : left >= 2 ? 2 : 1; }

template <int kRows, From kFrom, bool kActivated>
inline void packed_tiles(const float* a, int depth, const float* b, const float* bias, float* c, float smoothing) {
  for (int column = 0; column < kFieldBlock; column += kTileVectors * kLanes) {
    tile<kRows, kTileVectors, 1, kRows, kFrom, kActivated>(a, depth, b + column, kFieldBlock, bias, c + column,
                                                           kFieldBlock, smoothing);
  }
}

template <From kFrom, bool kActivated>
inline void packed_product(const float* packed, const float* bias, int rows, int depth, int used, const float* in,
                           float* out, float smoothing) {
  for (int row = 0; row < rows;) {
    const int height = tile_rows(rows - row);
    const float* a = packed + size_t(row) * size_t(depth);
    const float* add = kFrom == From::kBias ? bias + row : nullptr;
    float* c = out + size_t(row) * kFieldBlock;
    if (height == kTileRows) {
      packed_tiles<kTileRows, kFrom, kActivated>(a, used, in, add, c, smoothing);
    } else if (height == 4) {
      packed_tiles<4, kFrom, kActivated>(a, used, in, add, c, smoothing);
    } else if (height == 2) {
      packed_tiles<2, kFrom, kActivated>(a, used, in, add, c, smoothing);
    } else {
      packed_tiles<1, kFrom, kActivated>(a, used, in, add, c, smoothing);
    }
    row += height;
  }
}

void pack_steps(const float* weights, size_t row_step, size_t depth_step, int rows, int depth, float* packed) {
  for (int row = 0; row < rows;) {
    const int height = tile_rows(rows - row);
    for (int k = 0; k < depth; ++k) {
      for (int r = 0; r < height; ++r) *packed++ = weights[size_t(row + r) * row_step + size_t(k) * depth_step];
    }
    row += height;
  }
}

void pack(const float* weights, size_t stride, int rows, int depth, float* packed) {
  pack_steps(weights, stride, 1, rows, depth, packed);
}

void pack_transposed(const float* weights, size_t stride, int rows, int depth, float* packed) {
  pack_steps(weights, 1, stride, rows, depth, packed);
}

void multiply(const float* packed, int rows, int depth, int used, const float* in, float* out) {
  packed_product<From::kZero, false>(packed, nullptr, rows, depth, used, in, out, 0.0f);
}

void affine(const float* packed, const float* bias, int rows, int depth, const float* in, float* out) {
  packed_product<From::kBias, false>(packed, bias, rows, depth, depth, in, out, 0.0f);
}

void affine_activated(const float* packed, const float* bias, int rows, int depth, float smoothing, const float* in,
                      float* out) {
  packed_product<From::kBias, true>(packed, bias, rows, depth, depth, in, out, smoothing);
}

// --- squareplus ------------------------------------------------------------------------------------------------------

// From out = a(v) > 0: out (out - v) = b / 4, so 1 / sqrt(v v + b) = out / (out out + b / 4), and with that
// a' = out / sqrt(v v + b).
inline Vector inverse_root(Vector out, Vector quarter) { return out / multiply_add(out, out, quarter); }

void activation_backward(const float* out, int rows, float smoothing, const float* gradient, float* result) {
  const Vector quarter = broadcast(0.25f * smoothing);
  for (int i = 0; i < rows * kFieldBlock; i += kLanes) {
    const Vector h = load(out + i);
    store(result + i, load(gradient + i) * (h * inverse_root(h, quarter)));
  }
}

// --- the gradient of weights -----------------------------------------------------------------------------------------

#if defined(__clang__) || __GNUC__ >= 12
#define MAQ_SHUFFLE(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#else
#define MAQ_SHUFFLE(a, b, i, j, k, l) __builtin_shuffle(a, b, FourIndices{i, j, k, l})
#endif

// in [rows][kFieldBlock] -> out [kFieldBlock][stride], with zeros where there is no row.
void transpose(const float* in, int rows, size_t stride, float* out) {
  const auto four = [=](int row, int column) {
    return row < rows ? *reinterpret_cast<const Four*>(in + size_t(row) * kFieldBlock + column) : Four{};
  };
  const auto put = [=](int column, int row, Four value) {
    *reinterpret_cast<Four*>(out + size_t(column) * stride + row) = value;
  };
  for (int row = 0; row < int(stride); row += 4) {
    for (int column = 0; column < kFieldBlock; column += 4) {
      const Four a = four(row, column), b = four(row + 1, column), c = four(row + 2, column), d = four(row + 3, column);
      const Four low_ab = MAQ_SHUFFLE(a, b, 0, 4, 1, 5), high_ab = MAQ_SHUFFLE(a, b, 2, 6, 3, 7);
      const Four low_cd = MAQ_SHUFFLE(c, d, 0, 4, 1, 5), high_cd = MAQ_SHUFFLE(c, d, 2, 6, 3, 7);
      put(column, row, MAQ_SHUFFLE(low_ab, low_cd, 0, 1, 4, 5));
      put(column + 1, row, MAQ_SHUFFLE(low_ab, low_cd, 2, 3, 6, 7));
      put(column + 2, row, MAQ_SHUFFLE(high_ab, high_cd, 0, 1, 4, 5));
      put(column + 3, row, MAQ_SHUFFLE(high_ab, high_cd, 2, 3, 6, 7));
    }
  }
}

template <int kRows>
inline void sum_tiles(const float* gradient, const float* in, size_t stride, float* weights) {
  size_t column = 0;
  for (; column + kTileVectors * kLanes <= stride; column += kTileVectors * kLanes) {
    tile<kRows, kTileVectors, kFieldBlock, 1, From::kSum, false>(gradient, kFieldBlock, in + column, stride, nullptr,
                                                                 weights + column, stride, 0.0f);
  }
  for (; column < stride; column += kLanes) {
    tile<kRows, 1, kFieldBlock, 1, From::kSum, false>(gradient, kFieldBlock, in + column, stride, nullptr,
                                                      weights + column, stride, 0.0f);
  }
}

void weight_gradient(const float* gradient, int outputs, const float* in, int inputs, size_t stride, float* scratch,
                     float* weights, float* bias) {
  transpose(in, inputs, stride, scratch);
  for (int row = 0; row < outputs;) {
    const int height = tile_rows(outputs - row);
    const float* a = gradient + size_t(row) * kFieldBlock;
    float* c = weights + size_t(row) * stride;
    if (height == kTileRows) {
      sum_tiles<kTileRows>(a, scratch, stride, c);
    } else if (height == 4) {
      sum_tiles<4>(a, scratch, stride, c);
    } else if (height == 2) {
      sum_tiles<2>(a, scratch, stride, c);
    } else {
      sum_tiles<1>(a, scratch, stride, c);
    }
    row += height;
  }
  for (int row = 0; row < outputs && bias != nullptr; ++row) {
    Vector sum{};
    for (int column = 0; column < kFieldBlock; column += kLanes) {
      sum += load(gradient + size_t(row) * kFieldBlock + column);
    }
    float total = 0.0f;
    for (int i = 0; i < kLanes; ++i) total += sum[i];
    bias[row] += total;
  }
}

// --- the encoding ----------------------------------------------------------------------------------------------------

// Sine and cosine of the angle minus the nearest multiple of pi / 2, which is subtracted in three parts (Cody and
// Waite), by polynomials of Cephes (sinf, cosf).
inline void sine_and_cosine(Vector angle, Vector& sine, Vector& cosine) {
  const Vector rounding = broadcast(12582912.0f);  // 1.5 * 2^23: rounds the number that it is added to
  const Vector quarters = multiply_add(angle, broadcast(0.636619772f), rounding);
  const Mask quarter = reinterpret_cast<const Mask&>(quarters);
  const Vector whole = rounding - quarters;
  Vector x = multiply_add(whole, broadcast(1.5703125f), angle);
  x = multiply_add(whole, broadcast(4.837512969970703125e-4f), x);
  x = multiply_add(whole, broadcast(7.54978995489188216e-8f), x);
  const Vector one = broadcast(1.0f);  // where angles are so large that nothing is left of the rest, it stays bounded
  x = (x > one) ? one : x;
  x = (x < -one) ? -one : x;
  const Vector square = x * x;
  Vector s = multiply_add(square, broadcast(-1.9515295891e-4f), broadcast(8.3321608736e-3f));
  s = multiply_add(s, square, broadcast(-1.6666654611e-1f));
  s = multiply_add(s * square, x, x);
  Vector c = multiply_add(square, broadcast(2.443315711809948e-5f), broadcast(-1.388731625493765e-3f));
  c = multiply_add(c, square, broadcast(4.166664568298827e-2f));
  c = multiply_add(c * square, square, multiply_add(square, broadcast(-0.5f), one));
  const Mask swap = -(quarter & 1), sine_sign = (quarter & 2) << 30, cosine_sign = ((quarter + 1) & 2) << 30;
  const Mask s_bits = reinterpret_cast<const Mask&>(s), c_bits = reinterpret_cast<const Mask&>(c);
  const Mask sine_bits = ((s_bits & ~swap) | (c_bits & swap)) ^ sine_sign;
  const Mask cosine_bits = ((c_bits & ~swap) | (s_bits & swap)) ^ cosine_sign;
  sine = reinterpret_cast<const Vector&>(sine_bits);
  cosine = reinterpret_cast<const Vector&>(cosine_bits);
}

inline float* encoding_row(float* encoding, int octave, int part, int axis) {
  return encoding + size_t(3 + 6 * octave + 3 * part + axis) * kFieldBlock;
}
inline const float* encoding_row(const float* encoding, int octave, int part, int axis) {
  return encoding + size_t(3 + 6 * octave + 3 * part + axis) * kFieldBlock;
}

void encode(const float* points, int octaves, float* encoding) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int column = 0; column < kFieldBlock; column += kLanes) {
      Vector x = load(points + axis * kFieldBlock + column);
      x += x - x;  // infinity to NaN
      store(encoding + axis * kFieldBlock + column, x);
      for (int octave = 0; octave < octaves; ++octave) {
        Vector sine, cosine;
        sine_and_cosine(x, sine, cosine);
        store(encoding_row(encoding, octave, 0, axis) + column, sine);
        store(encoding_row(encoding, octave, 1, axis) + column, cosine);
        x += x;
      }
    }
  }
}

void encode_backward(const float* encoding, const float* gradient, int octaves, float* points_gradient) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int column = 0; column < kFieldBlock; column += kLanes) {
      Vector sum = load(gradient + axis * kFieldBlock + column);
      Vector frequency = broadcast(1.0f);
      for (int octave = 0; octave < octaves; ++octave) {
        const Vector by_sine = load(encoding_row(gradient, octave, 0, axis) + column);
        const Vector by_cosine = load(encoding_row(gradient, octave, 1, axis) + column);
        const Vector sine = load(encoding_row(encoding, octave, 0, axis) + column);
        const Vector cosine = load(encoding_row(encoding, octave, 1, axis) + column);
        sum = multiply_add(frequency, multiply_add(cosine, by_sine, -(sine * by_cosine)), sum);
        frequency += frequency;
      }
      float* to = points_gradient + axis * kFieldBlock + column;
      store(to, load(to) + sum);
    }
  }
}

// --- bases -----------------------------------------------------------------------------------------------------------

constexpr size_t kStep = 4 * kLanes;

void combine(const float* constant, const float* bases, const float* codes, int codes_count, size_t count, float* out) {
  constexpr size_t kPiece = 1024;  // floats, which stay in the first cache
  for (size_t begin = 0; begin < count; begin += kPiece) {
    const size_t end = begin + kPiece < count ? begin + kPiece : count;
    for (size_t i = begin; i < end; i += kLanes) store(out + i, load(constant + i));
    for (int k = 0; k < codes_count; ++k) {
      const Vector code = broadcast(codes[k]);
      const float* basis = bases + size_t(k) * count;
      for (size_t i = begin; i < end; i += kLanes) store(out + i, multiply_add(code, load(basis + i), load(out + i)));
    }
  }
}

float dot(const float* a, const float* b, size_t count) {
  Vector sums[4] = {};
  for (size_t i = 0; i < count; i += kStep) {
    MAQ_UNROLL for (int v = 0; v < 4; ++v) {
      sums[v] = multiply_add(load(a + i + v * kLanes), load(b + i + v * kLanes), sums[v]);
    }
  }
  const Vector sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  float total = 0.0f;
  for (int i = 0; i < kLanes; ++i) total += sum[i];
  return total;
}

constexpr FieldKernels kKernels = {
    encode,          encode_backward, pack, pack_transposed, multiply, affine, affine_activated, activation_backward,
    weight_gradient, combine,         dot};

}  // namespace

const FieldKernels& MAQ_FIELD_KERNELS() { return kKernels; }

}  // namespace maq::head
