#include "scene/render/scene_renderer.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "core/rounding.h"
#include "image/geometry/warp.h"
#include "scene/gravity_alignment.h"
#include "scene/render/refiner_roi.h"
#include "scene/visibility/view_frustum.h"

namespace maq {
namespace {

// So that the frames of a camera that rolls a little have few sizes: for every size a session is prepared
// (export/scenes/config.py has the same).
constexpr int kRotatedMultiple = 64;
// The scene's background shows where no point is within 16 x 16 pixels, and fades towards there: within them the image
// is the refiner's (export/scenes/fitting.py has the same). An app's own is blended by alpha.
constexpr int kOwnBackgroundGain = 4;

void check_render_camera(const PinholeCamera& camera) {
  check_camera(camera, "The camera");
  constexpr double kFarthest_px = 1e6, kLargestRatio = 1e3;
  if (std::max(std::abs(camera.cx_px), std::abs(camera.cy_px)) > kFarthest_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The camera's principal point (", camera.cx_px, ", ", camera.cy_px,
                ") is over ", kFarthest_px, " pixels away from its picture.");
  }
  const double ratio = camera.fx_px / camera.fy_px;
  if (!(ratio < kLargestRatio && ratio > 1 / kLargestRatio)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The camera's focal lengths of ", camera.fx_px, " and ", camera.fy_px,
                " pixels differ by a factor over ", kLargestRatio, ".");
  }
}

// Whether a corner of the image moves by as much as interpolation, of 1/32 pixel, can show.
bool is_visible_rotation(const PixelMap& map, const PinholeCamera& camera) {
  constexpr double kMinMove_px = 1.0 / 64;
  for (const double x : {0.0, double(camera.width_px)}) {
    for (const double y : {0.0, double(camera.height_px)}) {
      const double moved_x = map[0] * x + map[1] * y + map[2] - x, moved_y = map[3] * x + map[4] * y + map[5] - y;
      if (std::max(std::abs(moved_x), std::abs(moved_y)) > kMinMove_px) return true;
    }
  }
  return false;
}

// BGR of red, green, blue in 0..1.
std::array<uint8_t, 3> bytes_of(const std::array<float, 3>& colour) {
  const auto byte = [](float value) { return uint8_t(std::lround(255 * std::clamp(value, 0.0f, 1.0f))); };
  return {byte(colour[2]), byte(colour[1]), byte(colour[0])};
}

void clear(RenderedImage& image, const std::array<uint8_t, 3>& background) {
  for (size_t i = 0; i < image.bgr.size(); i += 3) std::copy_n(background.data(), 3, image.bgr.data() + i);
  std::fill(image.alpha.begin(), image.alpha.end(), uint8_t(0));
  std::fill(image.depth.begin(), image.depth.end(), 0.0f);
}

}  // namespace

SceneRenderer::SceneRenderer(Scene scene, std::shared_ptr<SceneNetworks> networks, const RenderOptions& options)
    : scene_(std::move(scene)),
      networks_(std::move(networks)),
      options_(options),
      threads_(options.threads),
      blocks_(scene_) {
  if (!std::isfinite(options.near)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The depth of the nearest point that is seen must be a finite number.");
  }
}

void SceneRenderer::project(const PinholeCamera& frame, RenderCounts& counts) {
  buffer_.begin(frame, options_.near, threads_.count());
  const ViewFrustum frustum(frame, std::max(0.0, options_.near));
  constexpr uint32_t kBlocksAtOnce = 8;
  std::atomic<uint32_t> blocks{0};
  std::atomic<uint64_t> points{0};
  threads_.run((scene_.block_count + kBlocksAtOnce - 1) / kBlocksAtOnce, [&](size_t task, int worker) {
    const uint32_t begin = uint32_t(task) * kBlocksAtOnce, end = std::min(scene_.block_count, begin + kBlocksAtOnce);
    for (uint32_t i = begin; i < end; ++i) {
      const SceneBlock& block = scene_.blocks[i];
      if (options_.skips_unseen_blocks && !frustum.may_show(scene_, block)) continue;
      buffer_.draw(span_of(scene_, block, frame.centre), worker);
      blocks += 1;
      points += block.count;
    }
  });
  counts.projected_blocks = blocks;
  counts.projected_points = points;
}

RasterWindow SceneRenderer::finish(const PinholeCamera& frame) {
  const int cells = frame.width_px / DescriptorRaster::kMultiple;
  occupied_.assign(size_t(frame.height_px / DescriptorRaster::kMultiple), {});
  threads_.run(occupied_.size(), [&](size_t strip, int) {
    const int top = int(strip) * DescriptorRaster::kMultiple;
    buffer_.finish(top, top + DescriptorRaster::kMultiple);
    buffer_.remove_occluded(top, top + DescriptorRaster::kMultiple, kDepthTolerance);
    int first = cells, last = -1;
    for (int y = top; y < top + DescriptorRaster::kMultiple; ++y) {
      const DepthKey* const row = buffer_.keys() + size_t(y) * size_t(frame.width_px);
      const auto has_points = [row](int cell) {
        const DepthKey* const begin = row + cell * DescriptorRaster::kMultiple;
        return std::any_of(begin, begin + DescriptorRaster::kMultiple, [](DepthKey key) { return key != kNoPointKey; });
      };
      for (int cell = 0; cell < first; ++cell) {
        if (has_points(cell)) first = cell;
      }
      for (int cell = cells - 1; cell > last; --cell) {
        if (has_points(cell)) last = cell;
      }
    }
    if (last >= 0)
      occupied_[strip] = {first * DescriptorRaster::kMultiple, top, (last + 1 - first) * DescriptorRaster::kMultiple,
                          DescriptorRaster::kMultiple};
  });
  RasterWindow all;
  for (const RasterWindow& strip : occupied_) {
    if (strip.width_px == 0) continue;
    if (all.width_px == 0) {
      all = strip;
      continue;
    }
    const int right = std::max(all.left_px + all.width_px, strip.left_px + strip.width_px);
    all.left_px = std::min(all.left_px, strip.left_px);
    all.width_px = right - all.left_px;
    all.height_px = strip.top_px + DescriptorRaster::kMultiple - all.top_px;
  }
  return all;
}

SceneRenderer::Frame SceneRenderer::frame_of(const PinholeCamera& camera) const {
  Frame frame;
  frame.camera = gravity_aligned_frame(camera, scene_.up, kRotatedMultiple);
  frame.to_frame = pixel_map_between(camera, frame.camera);
  frame.is_rotated = is_visible_rotation(frame.to_frame, camera);
  if (!frame.is_rotated) {
    frame.camera = camera;
    frame.camera.width_px = round_up(camera.width_px, DescriptorRaster::kMultiple);
    frame.camera.height_px = round_up(camera.height_px, DescriptorRaster::kMultiple);
  }
  if (int64_t(frame.camera.width_px) * frame.camera.height_px > SceneNetworks::kMaxPixels) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, "An image of ", camera.width_px, " x ", camera.height_px,
                " pixels is rendered in a frame of ", frame.camera.width_px, " x ", frame.camera.height_px,
                ", over the limit of ", SceneNetworks::kMaxPixels, " pixels; use a smaller one.");
  }
  return frame;
}

void SceneRenderer::refine(const PinholeCamera& frame, const RasterWindow& occupied,
                           const std::array<uint8_t, 3>& background, RenderedImage& image, RenderCounts& counts) {
  Stopwatch watch;
  const RasterWindow window = options_.skips_empty_parts ? window_to_refine(occupied, frame.width_px, frame.height_px)
                                                         : RasterWindow{0, 0, frame.width_px, frame.height_px};
  const RefinerLayout& layout = networks_->refiner_layout();
  raster_.shade({scene_, blocks_, buffer_, frame.centre, window, networks_->basis(), layout}, threads_);
  counts.shaded_points = raster_.shaded();
  counts.view_dependent_points = raster_.view_dependent();
  counts.refined_pixels = uint64_t(window.width_px) * uint64_t(window.height_px);
  if (counts.refined_pixels < counts.frame_pixels) clear(image, background);
  counts.reduce_ms = double(raster_.reduce_ns()) * 1e-6;
  counts.shade_ms = watch.lap_ms() - counts.reduce_ms;

  inputs_.clear();
  for (int level = 0; level < layout.levels; ++level) inputs_.push_back(raster_.level(level));
  const float* const refined = networks_->refine(inputs_, window.width_px, window.height_px);
  counts.refine_ms = watch.lap_ms();
  counts.provider = networks_->provider();

  coverage_.find(raster_, window.width_px, window.height_px, threads_);
  refined_.write(refined, layout, window, coverage_.alphas(), coverage_.depths(), background,
                 options_.background ? 1 : kOwnBackgroundGain,
                 {image.bgr.data(), image.alpha.data(), image.depth.data(), image.width_px, image.height_px}, threads_);
  counts.coverage_ms = watch.lap_ms();
}

void SceneRenderer::rotate_back(RenderedImage& from, const PixelMap& to_frame, RenderedImage& image) {
  constexpr int kRowsAtOnce = 64;
  threads_.run(size_t((image.height_px + kRowsAtOnce - 1) / kRowsAtOnce), [&](size_t strip, int) {
    const int top = int(strip) * kRowsAtOnce, bottom = std::min(image.height_px, top + kRowsAtOnce);
    const auto raster = [](auto& of, auto* pixels) {
      return Raster<std::remove_pointer_t<decltype(pixels)>>{pixels, of.width_px, of.height_px};
    };
    const RenderedImage& source = from;
    warp_bytes(raster(source, source.bgr.data()), 3, to_frame, raster(image, image.bgr.data()), top, bottom);
    warp_bytes(raster(source, source.alpha.data()), 1, to_frame, raster(image, image.alpha.data()), top, bottom);
    warp_depths(raster(source, source.depth.data()), to_frame, raster(image, image.depth.data()), top, bottom);
  });
}

RenderCounts SceneRenderer::render(const PinholeCamera& camera, RenderedImage& image) {
  check_render_camera(camera);
  const Stopwatch whole;
  Stopwatch watch;
  const Frame frame = frame_of(camera);
  RenderCounts counts;
  counts.blocks = scene_.block_count;
  counts.is_rotated = frame.is_rotated;
  counts.frame_pixels = uint64_t(frame.camera.width_px) * uint64_t(frame.camera.height_px);

  project(frame.camera, counts);
  const RasterWindow occupied = finish(frame.camera);
  counts.project_ms = watch.lap_ms();

  const std::array<uint8_t, 3> background = options_.background.value_or(bytes_of(scene_.background));
  const bool is_empty = occupied.width_px == 0;
  RenderedImage& aligned = frame.is_rotated ? aligned_image_ : image;
  const PinholeCamera& shown = frame.is_rotated ? frame.camera : camera;
  aligned.set_size(shown.width_px, shown.height_px);
  if (is_empty) {
    clear(aligned, background);
  } else {
    refine(frame.camera, occupied, background, aligned, counts);
  }
  if (frame.is_rotated) {
    watch = Stopwatch();
    image.set_size(camera.width_px, camera.height_px);
    if (is_empty) {
      clear(image, background);
    } else {
      rotate_back(aligned, frame.to_frame, image);
    }
    counts.rotate_ms = watch.lap_ms();
  }
  counts.all_ms = whole.elapsed_ms();
  return counts;
}

}  // namespace maq
