// What the refiner sees of a view: for each pixel how the point there looks from this side, at five scales
// (NPBG++, arXiv 2203.13318, section 3.4).
//
// Coarser scales are reduced from the finest, which is exact: half a camera's size moves a point from pixel floor(x) to
// pixel floor(x / 2), so whoever is nearest of the points of a coarse pixel is nearest in one of its four fine ones.
// Sides must be multiples of 16 for that. Who wins no pixel is not shaded.
//
// The picture is worked on in strips of 16 rows, from keys to all five scales, so that a strip stays in a core's cache.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "scene/format/block_index.h"
#include "scene/render/descriptor_decoding.h"
#include "scene/networks/scene_networks.h"
#include "scene/visibility/z_buffer.h"

namespace maq {

// A part of a picture; all figures are multiples of LookRaster::kMultiple.
struct RasterWindow {
  int left_px = 0, top_px = 0, width_px = 0, height_px = 0;
};

class LookRaster {
 public:
  static constexpr int kLevels = 5;
  static constexpr int kMultiple = 1 << (kLevels - 1);
  static constexpr int kChannels = SceneNetworks::kRasterChannels;  // the last is 1 where there is a point

  // Of a window of the finished `buffer`, in which a camera with that centre drew the points of `scene`; `blocks` are the
  // scene's. Throws MAQ_ERROR_INVALID_ARGUMENT where the window is not of multiples of 16, or not in the picture.
  void shade(const Scene& scene, const BlockIndex& blocks, const ZBuffer& buffer, const RasterWindow& window,
             const std::array<double, 3>& camera_centre, const ViewBasis& basis, const RefinerLayout& layout,
             WorkerThreads& threads);

  static constexpr size_t kColours = 3;  // features that are red, green and blue

  // As the layout says (the refiner's input of that number), with features and the 1 of a pixel side by side. Where there is
  // no point the colours are those of the next coarser level, in the coarsest the scene's background, all else is 0. All
  // kLevels, also where the refiner reads fewer: colours come from the coarsest.
  const float* level(int level) const { return levels_[level].data(); }
  // Who is nearest, row by row, at each of the kLevels scales.
  const DepthKey* keys(int level) const { return keys_[level].data(); }

  size_t shaded() const { return shaded_; }    // points that win a pixel
  size_t varying() const { return varying_; }  // of those, whose look depends on the side
  // Time spent, as a mean over the threads.
  int64_t shade_ns() const { return shade_ns_; }
  int64_t reduce_ns() const { return reduce_ns_; }

 private:
  struct Scratch {
    std::vector<PointToShade> constant, varying;
    size_t shaded = 0, varied = 0;
    int64_t shade_ns = 0, reduce_ns = 0;
  };
  struct Task;

  void shade_strip(const Task& task, int top, Scratch& scratch);
  void reduce_strip(const Task& task, int top);
  void fill_strip(const Task& task, int top);

  std::vector<float> levels_[kLevels];
  std::vector<DepthKey> keys_[kLevels];
  std::vector<Scratch> scratch_;
  size_t shaded_ = 0, varying_ = 0;
  int64_t shade_ns_ = 0, reduce_ns_ = 0;
};

}  // namespace maq
