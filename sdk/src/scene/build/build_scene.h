// A captured place as points that know how they look.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/build/scene_builder.h"
#include "scene/capture/capture.h"

namespace maq {

struct CaptureBuildOptions {
  BuildOptions points;
  // Larger photos are shrunk; 0: to no size, and over the networks' limit (SceneNetworks::kMostPixels) they are left out.
  int long_side_px = 1024;
  size_t most_views = 0;       // evenly from all that may be used; 0: all
  bool uses_held_out = false;  // photos that the capture keeps to compare with
};

struct BuiltCapture {
  ModelledPoints points;
  size_t views = 0;              // photos that saw points
  std::vector<Dropped> dropped;  // photos that could not be used, or see nothing
  BuildTimes times;
  double loading_ms = 0;
};

// Reads one photo after the other. `capture` may be given away (std::move), which saves a copy of its cloud. Returns nothing
// where `progress` cancelled. Throws MAQ_ERROR_INVALID_ARGUMENT for options out of range and where no photo
// is left; MAQ_ERROR_UNREADABLE where none can be used or sees a point; and what SceneBuilder throws.
std::optional<BuiltCapture> build_from_capture(Capture capture, SceneNetworks& networks,
                                               const CaptureBuildOptions& options, const BuildProgress& progress = {});

}  // namespace maq
