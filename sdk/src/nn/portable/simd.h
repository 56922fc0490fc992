// Vectors of 128 bits, the size that WebAssembly has, by the few operations of the layers. x86-64 has the same ones, so
// that native tests run the same code.
#pragma once

#include <cstdint>

#ifdef __wasm_simd128__
#include <wasm_simd128.h>
#else
#include <emmintrin.h>
#endif

namespace maq::simd {

#ifdef __wasm_simd128__

using Ints = v128_t;    // 8 of 16 bits, or 4 of 32
using Floats = v128_t;  // 4

inline Ints load(const int16_t* from) { return wasm_v128_load(from); }
inline Ints load(const int32_t* from) { return wasm_v128_load(from); }
inline Floats load(const float* from) { return wasm_v128_load(from); }
inline void store(int16_t* to, Ints values) { wasm_v128_store(to, values); }
inline void store(int32_t* to, Ints values) { wasm_v128_store(to, values); }
inline void store(float* to, Floats values) { wasm_v128_store(to, values); }
inline Ints zeros() { return wasm_i32x4_const(0, 0, 0, 0); }
inline Ints repeat_pair(const int16_t* pair) { return wasm_v128_load32_splat(pair); }
inline Floats repeat(const float* value) { return wasm_v128_load32_splat(value); }
inline Floats repeat(float value) { return wasm_f32x4_splat(value); }
// Sums of the products of neighbours: a0 * b0 + a1 * b1, …
inline Ints multiply_pairs(Ints a, Ints b) { return wasm_i32x4_dot_i16x8(a, b); }
inline Ints add_ints(Ints a, Ints b) { return wasm_i32x4_add(a, b); }
inline Ints subtract_ints(Ints a, Ints b) { return wasm_i32x4_sub(a, b); }
inline Ints interleave_low(Ints a, Ints b) { return wasm_i16x8_shuffle(a, b, 0, 8, 1, 9, 2, 10, 3, 11); }
inline Ints interleave_high(Ints a, Ints b) { return wasm_i16x8_shuffle(a, b, 4, 12, 5, 13, 6, 14, 7, 15); }
inline Ints narrow(Ints low, Ints high) { return wasm_i16x8_narrow_i32x4(low, high); }
inline Ints widen_low(Ints values) { return wasm_i32x4_extend_low_i16x8(values); }
inline Ints widen_high(Ints values) { return wasm_i32x4_extend_high_i16x8(values); }
inline Floats to_floats(Ints values) { return wasm_f32x4_convert_i32x4(values); }
inline Ints bits(Floats values) { return values; }
inline Floats multiply(Floats a, Floats b) { return wasm_f32x4_mul(a, b); }
inline Floats divide(Floats a, Floats b) { return wasm_f32x4_div(a, b); }
inline Floats add(Floats a, Floats b) { return wasm_f32x4_add(a, b); }
inline Floats at_most(Floats values, Floats limit) { return wasm_f32x4_pmin(values, limit); }
inline Floats at_least(Floats values, Floats limit) { return wasm_f32x4_pmax(values, limit); }
inline bool is_any_above(Floats values, Floats limit) { return wasm_v128_any_true(wasm_f32x4_gt(values, limit)); }

#else

using Ints = __m128i;
using Floats = __m128;

inline Ints load(const int16_t* from) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from)); }
inline Ints load(const int32_t* from) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(from)); }
inline Floats load(const float* from) { return _mm_loadu_ps(from); }
inline void store(int16_t* to, Ints values) { _mm_storeu_si128(reinterpret_cast<__m128i*>(to), values); }
inline void store(int32_t* to, Ints values) { _mm_storeu_si128(reinterpret_cast<__m128i*>(to), values); }
inline void store(float* to, Floats values) { _mm_storeu_ps(to, values); }
inline Ints zeros() { return _mm_setzero_si128(); }
inline Ints repeat_pair(const int16_t* pair) {
  return _mm_shuffle_epi32(_mm_cvtsi32_si128(int(uint16_t(pair[0]) | uint32_t(uint16_t(pair[1])) << 16)), 0);
}
inline Floats repeat(const float* value) { return _mm_set1_ps(*value); }
inline Floats repeat(float value) { return _mm_set1_ps(value); }
inline Ints multiply_pairs(Ints a, Ints b) { return _mm_madd_epi16(a, b); }
inline Ints add_ints(Ints a, Ints b) { return _mm_add_epi32(a, b); }
inline Ints subtract_ints(Ints a, Ints b) { return _mm_sub_epi32(a, b); }
inline Ints interleave_low(Ints a, Ints b) { return _mm_unpacklo_epi16(a, b); }
inline Ints interleave_high(Ints a, Ints b) { return _mm_unpackhi_epi16(a, b); }
inline Ints narrow(Ints low, Ints high) { return _mm_packs_epi32(low, high); }
inline Ints widen_low(Ints values) { return _mm_srai_epi32(_mm_unpacklo_epi16(values, values), 16); }
inline Ints widen_high(Ints values) { return _mm_srai_epi32(_mm_unpackhi_epi16(values, values), 16); }
inline Floats to_floats(Ints values) { return _mm_cvtepi32_ps(values); }
inline Ints bits(Floats values) { return _mm_castps_si128(values); }
inline Floats multiply(Floats a, Floats b) { return _mm_mul_ps(a, b); }
inline Floats divide(Floats a, Floats b) { return _mm_div_ps(a, b); }
inline Floats add(Floats a, Floats b) { return _mm_add_ps(a, b); }
inline Floats at_most(Floats values, Floats limit) { return _mm_min_ps(limit, values); }
inline Floats at_least(Floats values, Floats limit) { return _mm_max_ps(limit, values); }
inline bool is_any_above(Floats values, Floats limit) { return _mm_movemask_ps(_mm_cmpgt_ps(values, limit)) != 0; }

#endif

// Rounds to the nearest whole numbers, halves to even ones; values are below 2^22.
inline Ints round_to_ints(Floats values) {
  const Floats shift = repeat(12582912.0f);  // 1.5 * 2^23: the last bit of the sum counts ones
  return subtract_ints(bits(add(values, shift)), bits(shift));
}

// Whether one of the values lies so near to the middle between two whole numbers that a last bit could decide how it is
// rounded. `rounded` are the results of round_to_ints().
inline bool is_nearly_between(Floats values, Ints rounded) {
  constexpr float kMiddle = 0.5f - 0.0003f;
  const Floats off = add(values, multiply(to_floats(rounded), repeat(-1.0f)));
  return is_any_above(multiply(off, off), repeat(kMiddle * kMiddle));
}

}  // namespace maq::simd
