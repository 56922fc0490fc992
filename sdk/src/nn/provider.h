// Execution providers: libraries that may run the nodes of a graph instead of ONNX Runtime's own kernels. One that a
// build of ONNX Runtime does not have, or that takes too little of a graph, costs a line in the log and not the app's
// run.
#pragma once

#include <string>

#include "nn/onnxruntime_library.h"

struct OrtSession;
struct OrtSessionOptions;

namespace maq {

// `wanted`, or MAQ_PROVIDER_CPU where this build of ONNX Runtime does not offer it; the log says why.
maq_provider available_provider(const OnnxRuntimeLibrary& runtime, maq_provider wanted);

// Adds `provider`, which is not the CPU, to `options`, with that many threads where it has threads of its own. Throws
// MAQ_ERROR_UNSUPPORTED where this build does not offer it.
void append_provider(const OnnxRuntimeLibrary& runtime, maq_provider provider, int threads, OrtSessionOptions* options);

// Logs the share of a session's graph that `provider` runs. Throws MAQ_ERROR_UNSUPPORTED for less than half of the
// nodes: the CPU, which has few threads in such a session, would run the others. ONNX Runtime before 1.24 does not
// report the share; its choice stays.
void check_assignment(const OnnxRuntimeLibrary& runtime, maq_provider provider, const OrtSession* session,
                      const std::string& name);

}  // namespace maq
