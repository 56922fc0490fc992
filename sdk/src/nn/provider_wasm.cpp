#include "nn/provider.h"

namespace maq {

maq_provider available_provider(const OnnxRuntimeLibrary& runtime, maq_provider wanted) {
  if (wanted != MAQ_PROVIDER_CPU) {
    runtime.log().write(MAQ_LOG_WARNING, "Networks run on the CPU: there are no other providers in WebAssembly.");
  }
  return MAQ_PROVIDER_CPU;
}

}  // namespace maq
