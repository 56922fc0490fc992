// Functions whose loops the compiler turns into vectors twice: for any processor of the architecture and, on x86-64,
// for AVX2; which one runs is decided when the library is loaded. Both give the same bits: neither fuses multiply and
// add.
#pragma once

// Sanitizers are not ready yet when the loader asks which version to take.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
// flatten: what it calls must be inlined, or it would be compiled for any processor only.
#define MAQ_SIMD_CLONES __attribute__((target_clones("avx2", "default"), flatten))
#else
#define MAQ_SIMD_CLONES
#endif
