// Splats as a camera sees them: ellipses of pixels (EWA splatting, Zwicker et al. 2001; Kerbl et al. 2023, section 4).
#pragma once

#include <cstdint>

#include "image/geometry/pinhole_camera.h"
#include "scene/splats/splat_chunks.h"

namespace maq {

// Pixels of a tile.
inline constexpr int kTileWidth_px = 32, kTileHeight_px = 16;
// A pixel does not show a splat below this: 2 to the power of -kMaxFalloff is 1/255.
inline constexpr float kMaxFalloff = 7.9943535f;

struct TileRectangle {
  uint16_t left, top, right, bottom;  // the last two are behind the end
};

// A splat's weight at pixel (x, y) is 2 to the power of log_opacity - curvature * (x - middle)^2 - falloff * dy^2, with
// dy = y - this.y and middle = this.x - slope * dy. No difference of large numbers is in there, however thin it is.
struct ProjectedSplat {
  float x, y;
  float curvature, slope, falloff;
  float log_opacity;
  float rgb[3];
  float depth;
  TileRectangle tiles;
};

// A camera in the numbers that the projection needs.
class SplatView {
 public:
  // Splats nearer than `near` along the optical axis are not seen.
  SplatView(const PinholeCamera& camera, double near, bool is_antialiased);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  bool may_show(const SplatChunk& chunk) const;

  // Writes the splats of the chunk that the image shows, in their order, and returns how many these are. `projected`
  // has room for kChunkSplats, as has `places`, if it is there, which gets the splats' places in the chunk.
  int project(const SplatChunk& chunk, int sh_degree, ProjectedSplat* projected, uint8_t* places = nullptr) const;

  struct Parameters {
    float rotation[9];  // row by row: world to camera
    float fx, fy, cx, cy;
    float low_u, high_u, low_v, high_v;  // slopes of rays beyond which the projection is not linearised
    float near;
    float width, height;
    bool is_antialiased;
  };
  const Parameters& parameters() const { return by_; }

 private:
  Parameters by_{};
  std::array<double, 3> centre_;
  int width_px_, height_px_;
  std::array<std::array<double, 3>, 4> sides_{};  // normals, in the camera, of planes through it
};

}  // namespace maq
