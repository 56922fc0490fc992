// The pixels of one tile, from the splats that reach it.
#pragma once

#include "scene/splats/splat_projection.h"

namespace maq {

inline constexpr int kTilePixels = kTileWidth_px * kTileHeight_px;

// Sums of a tile's pixels, row by row. Colours and depth are weighted by what a splat adds to a pixel.
struct TileSums {
  alignas(32) float transmittance[kTilePixels];  // what is left for splats behind; at first 1
  alignas(32) float rgb[3][kTilePixels];
  alignas(32) float depth[kTilePixels];
};

// Blends splats [begin, end) of a list, in this order, into the tile whose first pixel is (left_px, top_px). What adds
// less than 1/1000 of a pixel's value in sum is left out. Returns how many splats were blended.
uint32_t blend_tile(const ProjectedSplat* splats, const uint32_t* begin, const uint32_t* end, int left_px, int top_px,
                    TileSums& sums);

// The change of a loss by the numbers of a ProjectedSplat.
struct SplatGradient {
  float log_opacity, curvature, slope, falloff, x, y, rgb[3];
};

// The gradients of a loss, for each splat of a list that blend_tile() blended: `loss` has its change by red, green and
// blue of each pixel, `sums` what blend_tile() left. `sums` is changed. (The chain rule through the blending, from
// front to back: what lies behind a splat is what the pixel has in all, less what lies before it.)
void tile_gradients(const ProjectedSplat* splats, const uint32_t* begin, const uint32_t* end, int left_px, int top_px,
                    const float loss[3][kTilePixels], TileSums& sums, SplatGradient* gradients);

}  // namespace maq
