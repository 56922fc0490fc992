#include "core/trace/trace_section.h"

namespace maq {

// Browsers have no such traces.
bool TraceSection::begin(const char*) { return false; }
void TraceSection::end() {}

}  // namespace maq
