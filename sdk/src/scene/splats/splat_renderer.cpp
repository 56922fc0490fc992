#include "scene/splats/splat_renderer.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "core/rounding.h"
#include "scene/splats/tile_blending.h"

namespace maq {
namespace {

uint8_t byte_of(float value) { return uint8_t(std::clamp(value * 255 + 0.5f, 0.0f, 255.0f)); }

// Writes a tile's pixels that are within the image.
void write_tile(const TileSums& sums, int left_px, int top_px, const std::array<uint8_t, 3>& background,
                RenderedImage& image) {
  const int columns = std::min(kTileWidth_px, image.width_px - left_px),
            rows = std::min(kTileHeight_px, image.height_px - top_px);
  float behind[3];
  for (size_t c = 0; c < 3; ++c) behind[c] = float(background[2 - c]) / 255;
  for (int row = 0; row < rows; ++row) {
    const size_t to = size_t(top_px + row) * size_t(image.width_px) + size_t(left_px);
    for (int column = 0; column < columns; ++column) {
      const int from = row * kTileWidth_px + column;
      const float through = sums.transmittance[from], seen = 1 - through;
      const size_t pixel = to + size_t(column);
      for (size_t c = 0; c < 3; ++c) {
        image.bgr[3 * pixel + 2 - c] = byte_of(sums.rgb[c][from] + through * behind[c]);
      }
      image.alpha[pixel] = byte_of(seen);
      image.depth[pixel] = image.alpha[pixel] > 0 ? sums.depth[from] / seen : 0;
    }
  }
}

}  // namespace

SplatRenderer::SplatRenderer(const Splats& splats, const SplatRenderOptions& options)
    : options_(options), threads_(options.threads), chunks_(splats) {
  if (!std::isfinite(options.near)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The depth of the nearest splat that is seen must be a finite number.");
  }
}

void SplatRenderer::project(const SplatView& view, SplatRenderCounts& counts) {
  const std::vector<SplatChunk>& chunks = chunks_.chunks();
  projected_.resize(chunks.size() * kChunkSplats);
  spans_.assign(chunks.size(), {0, 0});
  constexpr size_t kChunksAtOnce = 8;
  std::atomic<uint32_t> drawn{0};
  std::atomic<uint64_t> splats{0}, visible{0};
  threads_.run(divide_up(chunks.size(), kChunksAtOnce), [&](size_t task, int) {
    for (size_t i = task * kChunksAtOnce; i < std::min(chunks.size(), (task + 1) * kChunksAtOnce); ++i) {
      if (!view.may_show(chunks[i])) continue;
      const auto first = uint32_t(i * kChunkSplats);
      const int seen = view.project(chunks[i], chunks_.sh_degree(), projected_.data() + first);
      spans_[i] = {first, first + uint32_t(seen)};
      drawn += 1;
      splats += chunks[i].count;
      visible += uint64_t(seen);
    }
  });
  counts.drawn_chunks = drawn;
  counts.drawn_splats = splats;
  counts.visible_splats = visible;
}

SplatRenderCounts SplatRenderer::render(const PinholeCamera& camera, RenderedImage& image) {
  check_camera(camera, "The camera");
  const Stopwatch whole;
  Stopwatch watch;
  SplatRenderCounts counts;
  image.set_size(camera.width_px, camera.height_px);
  const int columns = divide_up(camera.width_px, kTileWidth_px), rows = divide_up(camera.height_px, kTileHeight_px);
  project(SplatView(camera, options_.near, chunks_.is_antialiased()), counts);
  counts.project_ms = watch.lap_ms();

  tiles_.sort(projected_.data(), spans_, columns, rows, threads_);
  counts.sort_ms = watch.lap_ms();
  blended_.assign(size_t(threads_.count()), 0);
  while (tiles_.fill_next(threads_)) {
    counts.sort_ms += watch.lap_ms();
    threads_.run(size_t(tiles_.end_tile() - tiles_.first_tile()), [&](size_t task, int worker) {
      const int tile = tiles_.first_tile() + int(task);
      const int left_px = tile % columns * kTileWidth_px, top_px = tile / columns * kTileHeight_px;
      TileSums sums;
      blended_[size_t(worker)] +=
          blend_tile(projected_.data(), tiles_.begin_of(tile), tiles_.end_of(tile), left_px, top_px, sums);
      write_tile(sums, left_px, top_px, options_.background, image);
    });
    counts.blend_ms += watch.lap_ms();
  }
  for (const uint64_t blended : blended_) counts.blended_splats += blended;
  counts.all_ms = whole.elapsed_ms();
  return counts;
}

}  // namespace maq
