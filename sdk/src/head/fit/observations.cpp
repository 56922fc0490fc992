#include "head/fit/observations.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace maq::head {
namespace {

constexpr double kMaxReach_dm = 16, kMinLogSigma = -4.6, kMaxLogSigma = 1.1;
constexpr int kMaxCellSide = 1024;

void check(const CellGrid& grid, const AffineMap& map) {
  if (grid.side < 1 || grid.side > kMaxCellSide || grid.cell_px < 1 || grid.cell_px > kMaxCellSide) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Observations of a head come in ", grid.side, " cells of ", grid.cell_px,
                " pixels. Give 1 to ", kMaxCellSide, " of each.");
  }
  const double determinant = map.xx * map.yy - map.xy * map.yx;
  const double values[] = {map.xx, map.xy, map.shift_x, map.yx, map.yy, map.shift_y};
  const bool is_finite = std::all_of(std::begin(values), std::end(values), [](double v) { return std::abs(v) < 1e6; });
  if (!is_finite || !(determinant > 1e-12)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT,
                "The place of a head's crop in its photo is not a rotation and a scaling. Give finite numbers.");
  }
}

bool is_inside(const HeadCell& cell, int width_px, int height_px) {
  return (width_px <= 0 || (cell.x_px >= -0.5 && cell.x_px < width_px - 0.5)) &&
         (height_px <= 0 || (cell.y_px >= -0.5 && cell.y_px < height_px - 0.5));
}

bool read_cell(const float* from, HeadCell& cell) {
  if (!std::all_of(from, from + kCellChannels, [](float value) { return std::isfinite(value); })) return false;
  if (!std::all_of(from, from + 3, [](float value) { return std::abs(double(value)) <= kMaxReach_dm; })) return false;
  cell.template_point = {double(from[0]), double(from[1]), double(from[2])};
  cell.sigma_dm = std::exp(std::clamp(double(from[3]), kMinLogSigma, kMaxLogSigma));
  cell.matte = 1 / (1 + std::exp(-double(from[4])));
  return true;
}

}  // namespace

HeadObservations read_observations(const float* cells, const CellGrid& grid, const AffineMap& crop_to_photo,
                                   int width_px, int height_px) {
  check(grid, crop_to_photo);
  HeadObservations seen;
  seen.side = grid.side;
  seen.crop_to_photo = crop_to_photo;
  seen.photo_to_crop = crop_to_photo.inverse();
  seen.cell_px = grid.cell_px * std::sqrt(crop_to_photo.xx * crop_to_photo.yy - crop_to_photo.xy * crop_to_photo.yx);
  seen.cells.resize(size_t(grid.side) * size_t(grid.side));
  for (size_t i = 0; i < seen.cells.size(); ++i) {
    HeadCell cell;
    const int row = int(i) / grid.side, column = int(i) % grid.side;
    const Point at = crop_to_photo({(column + 0.5) * grid.cell_px, (row + 0.5) * grid.cell_px});
    cell.x_px = at.x - 0.5, cell.y_px = at.y - 0.5;
    cell.is_usable = is_inside(cell, width_px, height_px) && read_cell(cells + i * kCellChannels, cell);
    if (cell.is_usable) {
      seen.cells[i] = cell;
    } else {
      ++seen.unusable;
    }
  }
  return seen;
}

}  // namespace maq::head
