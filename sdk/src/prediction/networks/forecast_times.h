// What networks that foresee a frame any time ahead are told of times, as the manifest of a bundle has them.
#pragma once

#include "nn/manifest.h"

namespace maq {

struct ForecastTimes {
  float min_fps = 0, max_fps = 0;  // of the clips that they were trained on
  float max_ahead = 0;             // in frames

  // Throws MAQ_ERROR_BAD_BUNDLE for what is missing or out of range.
  static ForecastTimes read(const ManifestNode& node);

  // log2 of ten times the seconds from frame to frame, and to the frame that is wanted: the nearest ones in training.
  void tell(float step_s, float ahead_s, float* two) const;
};

}  // namespace maq
