#include "nn/telemetry.h"

#include <cstdlib>

namespace maq {

void keep_telemetry_off() {
  if (std::getenv("ORT_DISABLE_TELEMETRY") == nullptr) ::_putenv_s("ORT_DISABLE_TELEMETRY", "1");
}

// Every release for Windows gives events to the system, which may send them.
void end_telemetry(const OrtApi& api, const OrtEnv* env) {
  if (OrtStatus* const status = api.DisableTelemetryEvents(env)) api.ReleaseStatus(status);
}

}  // namespace maq
