// The model options of a config: checked, and as the engine takes them.
#pragma once

#include <string>

#include "api/boundary.h"

namespace maq {

enum class ThreadMeasuring { kSupported, kUnsupported };

// Throws ArgumentError for values outside their range. `name` is the config's name and member: "config.model".
inline void require_model_options(const std::string& name, const maq_model_options& options,
                                  ThreadMeasuring measuring = ThreadMeasuring::kSupported) {
  if (measuring == ThreadMeasuring::kSupported) {
    require_threads(name + ".threads", options.threads, 64);
  } else {
    require_range(name + ".threads", options.threads, 0, 64);
  }
  require_provider(name + ".provider", options.provider);
}

}  // namespace maq
