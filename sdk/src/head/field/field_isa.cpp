#include "head/field/field_isa.h"

#include <algorithm>

#include "core/error.h"

namespace maq::head {

const char* field_isa_name(FieldIsa isa) {
  switch (isa) {
    case FieldIsa::kPortable: return "portable";
    case FieldIsa::kAvx2: return "AVX2";
    case FieldIsa::kAvx512: return "AVX-512";
  }
  return "unknown";
}

std::vector<FieldIsa> supported_field_isas() {
  std::vector<FieldIsa> isas{FieldIsa::kPortable};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    isas.push_back(FieldIsa::kAvx2);
    if (__builtin_cpu_supports("avx512f")) isas.push_back(FieldIsa::kAvx512);
  }
#endif
  return isas;
}

FieldIsa fastest_field_isa() {
  static const FieldIsa fastest = supported_field_isas().back();
  return fastest;
}

const FieldKernels& field_kernels(FieldIsa isa) {
  const std::vector<FieldIsa> supported = supported_field_isas();
  if (std::find(supported.begin(), supported.end(), isa) == supported.end()) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "This processor or this build has no vectors of the kind ", field_isa_name(isa),
                ". Choose another kind.");
  }
#if defined(__x86_64__)
  if (isa == FieldIsa::kAvx2) return field_kernels_avx2();
  if (isa == FieldIsa::kAvx512) return field_kernels_avx512();
#endif
  return field_kernels_portable();
}

}  // namespace maq::head
