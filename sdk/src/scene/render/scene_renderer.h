// New views of a scene (NPBG++, arXiv 2203.13318): points, rasters of their looks, the refiner's picture.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/worker_threads.h"
#include "scene/networks/scene_networks.h"
#include "scene/render/coverage.h"
#include "scene/render/refined_picture.h"

namespace maq {

struct RenderOptions {
  int threads = 1;  // of everything but the refiner, whose threads are its networks'
  double near = 0;  // depth of the nearest point that is seen, in units of the scene
  // BGR, which the picture is drawn over by its alpha. Without, what has no point near is of the scene's background
  // colour, and the refiner's picture is left as it is elsewhere.
  std::optional<std::array<uint8_t, 3>> background;
  // Work that is left out. Neither changes a pixel with an alpha above 0.
  bool skips_unseen_blocks = true;
  bool skips_empty_parts = true;
};

// Work and time of one picture.
struct RenderCounts {
  uint32_t blocks = 0;            // of the scene
  uint32_t projected_blocks = 0;  // of those, not left out
  uint64_t projected_points = 0;
  uint64_t shaded_points = 0;   // that win a pixel
  uint64_t varying_points = 0;  // of those, whose look depends on the side
  uint64_t frame_pixels = 0;    // of the upright frame
  uint64_t refined_pixels = 0;  // of those, seen by the refiner
  bool is_turned = false;
  double project_ms = 0, shade_ms = 0, reduce_ms = 0, refine_ms = 0, cover_ms = 0, turn_ms = 0, all_ms = 0;
};

// All without padding, row by row.
struct RenderedPicture {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> bgr;
  std::vector<uint8_t> alpha;  // as of PictureCover: 0 nothing near, 255 surely covered
  // Depth of the nearest point, along the optical axis in units of the scene; 0 where no point is near.
  std::vector<float> depth;
  RenderCounts counts;
};

class SceneRenderer {
 public:
  // The networks must be those that the scene was made with, in any precision. Throws MAQ_ERROR_INVALID_ARGUMENT for
  // options that are none.
  SceneRenderer(Scene scene, std::shared_ptr<SceneNetworks> networks, const RenderOptions& options);

  // Renders upright in the smallest frame that holds the camera's picture, and turns the result back. The same picture with
  // any number of threads. Memory of `picture` is reused. Not for two threads at once, nor while another uses the
  // networks' refiner. Throws what check_camera() and SceneNetworks::refine() throw, and MAQ_ERROR_INVALID_ARGUMENT for a
  // camera whose principal point is over 10^6 pixels away or whose focal lengths differ by a factor over 1000.
  void render(const PinholeCamera& camera, RenderedPicture& picture);

 private:
  void project(const PinholeCamera& frame, RenderCounts& counts);
  // Brings the workers' sheets together and finds the part that has points; no sides when there are none.
  RasterWindow finish(const PinholeCamera& frame);

  Scene scene_;
  std::shared_ptr<SceneNetworks> networks_;
  RenderOptions options_;
  WorkerThreads threads_;
  BlockIndex blocks_;
  ZBuffer buffer_;
  LookRaster raster_;
  PictureCover cover_;
  RefinedPicture refined_;
  std::vector<const float*> inputs_;
  std::vector<RasterWindow> occupied_;  // one for each strip
  RenderedPicture upright_;
};

}  // namespace maq
