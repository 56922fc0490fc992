// A file, a recording or a stub as if it were a camera: its frames come at their times, whether or not somebody takes
// them.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sources/camera_backend.h"
#include "sources/source.h"

namespace maq {

struct PlayOptions {
  double speed = 1;
  bool loop = false;
  int buffers = 4;
};

// Opens the source at once, and again each time it is to begin anew. Cameras of the opener that follow one another go on
// in the same source: what came while none was open is lost, as with a camera that was unplugged. `identity` is theirs.
CameraOpener played_as_camera(std::function<std::unique_ptr<Source>()> open, std::string identity, PlayOptions options);

}  // namespace maq
