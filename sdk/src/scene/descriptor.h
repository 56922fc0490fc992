// A descriptor: how a point appears, as the networks see it (NPBG++, arXiv 2203.13318, section 3.3).
#pragma once

#include <cstddef>

namespace maq {

inline constexpr int kFeatures = 8;  // of a descriptor; the first three are red, green and blue in 0..1
inline constexpr int kBasis = 6;     // functions of the viewing direction that it is linear in
// Linear terms of a view-dependent descriptor, beyond its constant term: [kBasis][kFeatures].
inline constexpr size_t kLinearTerms = size_t(kBasis) * kFeatures;

}  // namespace maq
