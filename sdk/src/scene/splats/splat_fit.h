// Splats fitted to photos: colour, opacity, size, rotation and position by gradient descent through the renderer.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "image/geometry/pinhole_camera.h"
#include "scene/capture/capture.h"
#include "scene/splats/splats.h"

namespace maq {

struct FitPhoto {
  PinholeCamera camera;
  std::vector<uint8_t> bgr;    // of the camera's size
  std::vector<uint8_t> valid;  // 0: pixels that are not of the photo; empty: all are
};

// The photos of a capture that a scene is made of, without distortion. `long_side_px`: larger ones are made smaller; 0:
// none. Photos that cannot be read are left out. Throws MAQ_ERROR_UNREADABLE if no photo is left.
std::vector<FitPhoto> photos_to_fit(const Capture& capture, int long_side_px, bool uses_held_out);

struct SplatFitOptions {
  double seconds = 60;
  uint64_t max_steps = 1'000'000;  // a step fits to one photo
  int threads = 1;
  uint64_t seed = 1;  // of the order of the photos
};

// The mean squared error of each photo, colours of 0 to 1, before its first step and in its last.
struct SplatFitErrors {
  double first = 0, last = 0;
  uint64_t steps = 0;
};

// Gets the finished part and a sentence; false cancels.
using SplatFitProgress = std::function<bool(double, const std::string&)>;

// Fits splats without harmonics by Adam (Kingma and Ba 2015) to one photo after the other until the time is over. No
// splats are made or removed. Cancelled, the splats are those of the last step. Throws MAQ_ERROR_INVALID_ARGUMENT
// without photos, and for photos whose pixels are not of the camera's size.
SplatFitErrors fit_splats(Splats& splats, const std::vector<FitPhoto>& photos, const SplatFitOptions& options,
                          const SplatFitProgress& progress = {});

}  // namespace maq
