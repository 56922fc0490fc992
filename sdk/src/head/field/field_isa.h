// Which vectors of the processor the field engine uses.
#pragma once

#include <vector>

#include "head/field/field_kernels.h"

namespace maq::head {

enum class FieldIsa {
  kPortable,  // 4 floats: SSE2 on x86-64, NEON on aarch64
  kAvx2,      // 8 floats, and multiply and add at once
  kAvx512     // 16 floats
};

const char* field_isa_name(FieldIsa isa);

// Returns the instruction sets that this processor and this build support, the fastest last.
std::vector<FieldIsa> supported_field_isas();
FieldIsa fastest_field_isa();

// Throws MAQ_ERROR_UNSUPPORTED for one that is not supported.
const FieldKernels& field_kernels(FieldIsa isa);

}  // namespace maq::head
