// Replays a file, a recording or a stub as a camera: its frames come at their times, whether or not they are taken.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "sources/camera_backend.h"
#include "sources/source.h"

namespace maq {

struct ReplayOptions {
  double speed = 1;
  bool loop = false;
  int buffers = 4;
};

// Opens the source at once, and again for each loop. The cameras of the opener, one after another, continue in the same
// source: frames due while none was open are lost, as with a camera that was unplugged. `identity` is
// Camera::identity().
CameraOpener replay_as_camera(std::function<std::unique_ptr<Source>()> open, std::string identity,
                              ReplayOptions options);

}  // namespace maq
