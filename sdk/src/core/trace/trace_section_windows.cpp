#include "core/trace/trace_section.h"

namespace maq {

bool TraceSection::begin(const char*) { return false; }

void TraceSection::end() {}

}  // namespace maq
