#include "nn/onnxruntime_library.h"

namespace maq {

// Sessions run on nn/portable (session_wasm.cpp).
OnnxRuntimeLibrary::OnnxRuntimeLibrary(const std::string&, const Log& log) : log_(log), version_("none") {}

OnnxRuntimeLibrary::~OnnxRuntimeLibrary() = default;

}  // namespace maq
