// The colour of the photos where the cloud has no points.
#pragma once

#include <array>
#include <cstdint>

#include "core/frame.h"
#include "scene/visibility/z_buffer.h"

namespace maq {

// Sums over photos, red, green and blue in 0..1.
class BackgroundColour {
 public:
  // A side of the blocks of the z-buffer's pixels that without a point are background.
  static constexpr int kBlockPx = 16;

  // A BGR photo, and the points visible in it, in a z-buffer of any size. `valid`: the validity mask, 0 for pixels that
  // are not of the photo; null when all are.
  void add(const ImageView& photo, const uint8_t* valid, const ZBuffer& seen);
  void add(const BackgroundColour& other);

  // The mean of background pixels; of all where there are none; black without photos.
  std::array<float, 3> mean() const;

 private:
  struct Sum {
    std::array<double, 3> colour = {0, 0, 0};
    double count = 0;
  };
  Sum background_, all_;
};

}  // namespace maq
