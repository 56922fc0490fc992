// New views of a scene (NPBG++, arXiv 2203.13318): visible points, rasters of their descriptors, the refiner's image.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/worker_threads.h"
#include "image/rendered_image.h"
#include "scene/gravity_alignment.h"
#include "scene/networks/scene_networks.h"
#include "scene/render/coverage.h"
#include "scene/render/refined_image.h"

namespace maq {

struct RenderOptions {
  int threads = 1;  // of everything but the refiner, whose threads are its networks'
  double near = 0;  // depth of the nearest point that is seen, in units of the scene
  // BGR, which the image is blended over by its alpha. Without, pixels without a point near are of the scene's
  // background colour, and the refiner's output is left as it is elsewhere.
  std::optional<std::array<uint8_t, 3>> background;
  // Work that is skipped. Neither changes a pixel with an alpha above 0.
  bool skips_unseen_blocks = true;
  bool skips_empty_parts = true;
};

// Work and time of one image.
struct RenderCounts {
  uint32_t blocks = 0;            // of the scene
  uint32_t projected_blocks = 0;  // of those, not culled
  uint64_t projected_points = 0;
  uint64_t shaded_points = 0;                // visible ones
  uint64_t view_dependent_points = 0;        // of those
  uint64_t frame_pixels = 0;                 // of the gravity-aligned frame
  uint64_t refined_pixels = 0;               // of those, seen by the refiner
  maq_provider provider = MAQ_PROVIDER_CPU;  // of the refiner
  bool is_rotated = false;
  double project_ms = 0, shade_ms = 0, reduce_ms = 0, refine_ms = 0, coverage_ms = 0, rotate_ms = 0, all_ms = 0;
};

class SceneRenderer {
 public:
  // The scene must have been built with the same networks, in any precision. Throws MAQ_ERROR_INVALID_ARGUMENT for
  // options out of range.
  SceneRenderer(Scene scene, std::shared_ptr<SceneNetworks> networks, const RenderOptions& options);

  // Renders gravity-aligned in the smallest frame that holds the camera's image, and rotates the result back. The same
  // image with any number of threads. Alpha is as of Coverage; depth is in units of the scene. Not for two threads at
  // once, nor while another uses the networks' refiner. Throws the errors of check_camera() and
  // SceneNetworks::refine(), and MAQ_ERROR_INVALID_ARGUMENT for a camera with a principal point over 10^6 pixels away
  // or focal lengths that differ by a factor over 1000.
  RenderCounts render(const PinholeCamera& camera, RenderedImage& image);

 private:
  // The frame to render in, and how the camera's pixels map to its.
  struct Frame {
    PinholeCamera camera;
    PixelMap to_frame{};
    bool is_rotated = false;
  };
  Frame frame_of(const PinholeCamera& camera) const;
  void project(const PinholeCamera& frame, RenderCounts& counts);
  // Merges the workers' depth buffers and finds the part that has points; of size 0 when there are none.
  RasterWindow finish(const PinholeCamera& frame);
  // Shades and refines the points in the depth buffer.
  void refine(const PinholeCamera& frame, const RasterWindow& occupied, const std::array<uint8_t, 3>& background,
              RenderedImage& image, RenderCounts& counts);
  void rotate_back(RenderedImage& from, const PixelMap& to_frame, RenderedImage& image);

  Scene scene_;
  std::shared_ptr<SceneNetworks> networks_;
  RenderOptions options_;
  WorkerThreads threads_;
  BlockIndex blocks_;
  ZBuffer buffer_;
  DescriptorRaster raster_;
  Coverage coverage_;
  RefinedImage refined_;
  std::vector<const float*> inputs_;
  std::vector<RasterWindow> occupied_;  // one for each strip
  RenderedImage aligned_image_;
};

}  // namespace maq
