// Images of splats on the CPU: sorted by depth, blended from front to back in tiles.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/worker_threads.h"
#include "image/rendered_image.h"
#include "scene/splats/splat_projection.h"
#include "scene/splats/splat_tiles.h"

namespace maq {

struct SplatRenderOptions {
  int threads = 1;
  double near = 0;                                // depth of the nearest splat that is seen
  std::array<uint8_t, 3> background = {0, 0, 0};  // BGR behind the splats
};

// Work and time of one image.
struct SplatRenderCounts {
  uint32_t drawn_chunks = 0;
  uint64_t drawn_splats = 0;    // of these chunks
  uint64_t visible_splats = 0;  // of those, within the image
  uint64_t blended_splats = 0;  // in all tiles, until they were opaque
  double project_ms = 0, sort_ms = 0, blend_ms = 0, all_ms = 0;
};

class SplatRenderer {
 public:
  // Copies the splats.
  SplatRenderer(const Splats& splats, const SplatRenderOptions& options);

  // Alpha is 255 where nothing shows through; depth is the mean of what a pixel shows. The same image with any number
  // of threads. Splats that reach behind the camera are not seen. Not for two threads at once. Throws the errors of
  // check_camera().
  SplatRenderCounts render(const PinholeCamera& camera, RenderedImage& image);

 private:
  void project(const SplatView& view, SplatRenderCounts& counts);

  SplatRenderOptions options_;
  WorkerThreads threads_;
  SplatChunks chunks_;
  SplatTiles tiles_;
  std::vector<ProjectedSplat> projected_;             // kChunkSplats for each chunk
  std::vector<std::pair<uint32_t, uint32_t>> spans_;  // of these, the visible ones
  std::vector<uint64_t> blended_;                     // by worker
};

}  // namespace maq
