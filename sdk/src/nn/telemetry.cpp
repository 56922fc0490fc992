#include "nn/telemetry.h"

#include <cstdlib>

namespace maq {

// Releases from 1.29 on carry telemetry that starts when the library is loaded.
void keep_telemetry_off() { setenv("ORT_DISABLE_TELEMETRY", "1", 0); }

void end_telemetry(const OrtApi&, const OrtEnv*) {}

}  // namespace maq
