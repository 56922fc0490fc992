// Functions whose loops the compiler turns into vectors twice: for any processor of the architecture and, on x86-64,
// for AVX2; which one runs is decided when the library is loaded. Both give the same bits: neither fuses multiply and
// add.
#pragma once

#include <cstdint>
#include <cstring>

// Sanitizers are not ready yet when the loader asks which version to take. Windows' loader does not ask.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__) && !defined(_WIN32)
// flatten: called functions must be inlined; otherwise they would be compiled for any processor only.
#define MAQ_SIMD_CLONES __attribute__((target_clones("avx2", "default"), flatten))
#else
#define MAQ_SIMD_CLONES
#endif

namespace maq {

// exp(x) for x from -87 to 0 within 3e-7 of its value, without a call, so that a loop of it becomes vectors: 2^x by the
// whole part in the exponent and a polynomial (Taylor) for the rest, which lies within half a unit.
inline float exp_of_negative(float x) {
  constexpr float kLog2E = 1.44269504f, kLn2 = 0.69314718f,
                  kRound = 12582912.0f;  // 1.5 * 2^23: rounds the number that it is added to
  const float scaled = x * kLog2E;
  const float whole = (scaled + kRound) - kRound;
  const float rest = (scaled - whole) * kLn2;
  float sum = 1.0f / 720.0f;
  for (const float factor : {1.0f / 120.0f, 1.0f / 24.0f, 1.0f / 6.0f, 0.5f, 1.0f, 1.0f}) sum = sum * rest + factor;
  const int32_t bits = (int32_t(whole) + 127) << 23;
  float power;
  std::memcpy(&power, &bits, sizeof power);
  return sum * power;
}

}  // namespace maq
