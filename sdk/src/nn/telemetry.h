// Reports that ONNX Runtime would send.
#pragma once

#include <onnxruntime_c_api.h>

namespace maq {

// Before the library is loaded. Does not overwrite a choice that the process already made.
void keep_telemetry_off();

// Once its environment is there.
void end_telemetry(const OrtApi& api, const OrtEnv* env);

}  // namespace maq
