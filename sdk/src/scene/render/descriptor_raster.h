// The refiner's input of a view: for each pixel the descriptor of the visible point, at five scales (NPBG++, arXiv
// 2203.13318, section 3.4).
//
// Coarser scales are reduced from the finest, which is exact: half a camera's size moves a point from pixel floor(x) to
// pixel floor(x / 2), so the nearest point of a coarse pixel is the nearest of one of its four fine ones.
// Sides must be multiples of 16 for that. Only visible points are shaded.
//
// The image is made in strips of 16 rows, from keys to all five scales, so that a strip stays in a core's cache.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "scene/format/scene.h"
#include "scene/networks/scene_networks.h"
#include "scene/render/descriptor_decoding.h"
#include "scene/visibility/z_buffer.h"

namespace maq {

// A part of an image; all numbers are multiples of DescriptorRaster::kMultiple.
struct RasterWindow {
  int left_px = 0, top_px = 0, width_px = 0, height_px = 0;
};

class DescriptorRaster {
 public:
  static constexpr int kLevels = 5;
  static constexpr int kMultiple = 1 << (kLevels - 1);
  static constexpr int kChannels = SceneNetworks::kRasterChannels;  // the last is 1 where there is a point

  // The points to shade, and the refiner's layout. All must outlive the call.
  struct View {
    const Scene& scene;
    const BlockIndex& blocks;  // of the scene
    const ZBuffer& buffer;     // finished: the scene's points as the camera sees them
    std::array<double, 3> camera_centre;
    RasterWindow window;  // of the buffer
    const ViewBasis& basis;
    const RefinerLayout& layout;
  };
  // Throws MAQ_ERROR_INVALID_ARGUMENT where the window is not of multiples of 16, or not in the buffer.
  void shade(const View& view, WorkerThreads& threads);

  static constexpr size_t kColours = 3;  // features that are red, green and blue

  // The refiner's input of that number, in its layout, with features and the 1 of a pixel side by side. Pixels without
  // a point have the colour of the next coarser level, or in the coarsest level the scene's background; their other
  // channels are 0. All kLevels, also where the refiner reads fewer: colours come from the coarsest.
  const float* level(int level) const { return levels_[level].data(); }
  // Keys of the visible points, row by row, at each of the kLevels scales.
  const DepthKey* keys(int level) const { return keys_[level].data(); }

  size_t shaded() const { return shaded_; }                  // visible points
  size_t view_dependent() const { return view_dependent_; }  // of those
  // Time spent, as a mean over the threads.
  int64_t shade_ns() const { return shade_ns_; }
  int64_t reduce_ns() const { return reduce_ns_; }

 private:
  struct Scratch {
    std::vector<PointToShade> constant, view_dependent;
    size_t shaded = 0, shaded_view_dependent = 0;
    int64_t shade_ns = 0, reduce_ns = 0;
  };

  void shade_strip(const View& view, int top, Scratch& scratch);
  void reduce_strip(const View& view, int top);
  void fill_strip(const View& view, int top);

  std::vector<float> levels_[kLevels];
  std::vector<DepthKey> keys_[kLevels];
  std::vector<Scratch> scratch_;
  size_t shaded_ = 0, view_dependent_ = 0;
  int64_t shade_ns_ = 0, reduce_ns_ = 0;
};

}  // namespace maq
