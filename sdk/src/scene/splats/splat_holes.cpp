#include "scene/splats/splat_holes.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"
#include "scene/splats/splat_renderer.h"

namespace maq {
namespace {

constexpr int kCell_px = 8;
constexpr int kCellsAround = 2;         // in which the depth is looked for
constexpr float kCovered = 0.5f;        // mean alpha of cells that need no splat
constexpr double kCellDeviation = 0.6;  // of a cell's splat, in cells
constexpr float kHoleOpacity = 0.95f;
// Photos are shared out to rounds, so that photos of later rounds see the splats of the earlier ones.
constexpr size_t kRounds = 4;

struct HoleCell {
  float alpha = 0, depth = 0;  // means; 0: no splat is there
  float rgb[3] = {};
  bool is_valid = true;  // whether all pixels are of the photo
};

HoleCell cell_at(const FitPhoto& photo, const RenderedImage& image, int column, int row) {
  HoleCell cell;
  double depth = 0, count = 0;
  const int right = std::min((column + 1) * kCell_px, image.width_px),
            bottom = std::min((row + 1) * kCell_px, image.height_px);
  for (int y = row * kCell_px; y < bottom; ++y) {
    for (int x = column * kCell_px; x < right; ++x) {
      const size_t pixel = size_t(y) * size_t(image.width_px) + size_t(x);
      const float alpha = float(image.alpha[pixel]) / 255;
      cell.alpha += alpha;
      depth += double(alpha * image.depth[pixel]);
      for (size_t c = 0; c < 3; ++c) cell.rgb[c] += float(photo.bgr[3 * pixel + 2 - c]) / 255;
      cell.is_valid = cell.is_valid && (photo.valid.empty() || photo.valid[pixel] != 0);
      count += 1;
    }
  }
  cell.depth = cell.alpha > 0 ? float(depth / double(cell.alpha)) : 0;
  cell.alpha /= float(count);
  for (float& value : cell.rgb) value /= float(count);
  return cell;
}

// The depth that most covered cells are nearer than; 0 without any.
float far_depth(const std::vector<HoleCell>& cells) {
  std::vector<float> depths;
  for (const HoleCell& cell : cells) {
    if (cell.alpha > kCovered) depths.push_back(cell.depth);
  }
  if (depths.empty()) return 0;
  const auto at = depths.begin() + std::ptrdiff_t(depths.size() * 19 / 20);
  std::nth_element(depths.begin(), at, depths.end());
  return *at;
}

Splat splat_of_cell(const PinholeCamera& camera, const HoleCell& cell, double x, double y, double depth) {
  Splat splat;
  const double in_camera[3] = {(x - camera.cx_px) / camera.fx_px * depth, (y - camera.cy_px) / camera.fy_px * depth,
                               depth};
  for (size_t i = 0; i < 3; ++i) {
    splat.position[i] = camera.centre[i];
    for (size_t k = 0; k < 3; ++k) splat.position[i] += camera.rotation[3 * k + i] * in_camera[k];
  }
  const auto deviation = float(kCellDeviation * kCell_px * depth / std::max(camera.fx_px, camera.fy_px));
  splat.scale = {deviation, deviation, deviation};
  splat.opacity = kHoleOpacity;
  splat.colour = {cell.rgb[0], cell.rgb[1], cell.rgb[2]};
  return splat;
}

size_t fill_holes_of(const FitPhoto& photo, const RenderedImage& image, Splats& splats) {
  const int columns = divide_up(image.width_px, kCell_px), rows = divide_up(image.height_px, kCell_px);
  std::vector<HoleCell> cells;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) cells.push_back(cell_at(photo, image, column, row));
  }
  const float usual = far_depth(cells);
  size_t added = 0;
  for (int row = 0; row < rows && usual > 0; ++row) {
    for (int column = 0; column < columns; ++column) {
      const HoleCell& cell = cells[size_t(row * columns + column)];
      if (cell.alpha > kCovered || !cell.is_valid) continue;
      float depth = 0;
      for (int y = std::max(row - kCellsAround, 0); y <= std::min(row + kCellsAround, rows - 1); ++y) {
        for (int x = std::max(column - kCellsAround, 0); x <= std::min(column + kCellsAround, columns - 1); ++x) {
          const HoleCell& around = cells[size_t(y * columns + x)];
          if (around.alpha > kCovered) depth = std::max(depth, around.depth);
        }
      }
      const double x = (column + 0.5) * kCell_px - 0.5, y = (row + 0.5) * kCell_px - 0.5;
      added += splats.add(splat_of_cell(photo.camera, cell, x, y, double(depth > 0 ? depth : usual))) ? 1 : 0;
    }
  }
  return added;
}

}  // namespace

size_t fill_holes(Splats& splats, const std::vector<FitPhoto>& photos, int threads) {
  size_t added = 0;
  SplatRenderOptions options;
  options.threads = threads;
  RenderedImage image;
  for (size_t round = 0; round < std::min(kRounds, photos.size()); ++round) {
    SplatRenderer renderer(splats, options);
    for (size_t i = round; i < photos.size(); i += kRounds) {
      renderer.render(photos[i].camera, image);
      added += fill_holes_of(photos[i], image, splats);
    }
  }
  return added;
}

}  // namespace maq
