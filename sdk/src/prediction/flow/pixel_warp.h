// Warps image rows along a flow field: the loops over pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/flow/optical_flow.h"
#include "prediction/flow/plane_samples.h"

namespace maq {

// Share of the warped image in each cell, 0 to 1, interpolated between cells; the unwarped image has the rest.
struct CellWeights {
  int columns = 0, rows = 0;
  int cell_px = 1;  // side, in field pixels
  std::vector<float> weights;
  float mean = 0;
};

// Scratch memory for one row: displacements, then source pixels with the weights (of 256) of their right and lower
// neighbours.
struct WarpRow {
  std::vector<float> upper_dx, upper_dy;  // between two field rows
  std::vector<float> dx, dy;
  std::vector<int> left, right, x_weight, above, below, y_weight;
  std::vector<float> cell_weights, weights;  // between two cell rows; per pixel, of 256
  std::vector<uint16_t> byte_weights;
};

// Warps row `y` of a plane. One field pixel covers `scale` x `scale` frame pixels. Reads one byte after the end of
// `from` when pixels have three bytes.
void warp_row(const PlaneSamples& plane, const FlowField& field, int scale, int y, WarpRow& row);

// Blends a warped row with the same row of `from`.
void blend_row(const PlaneSamples& plane, const CellWeights& weights, int scale, int y, WarpRow& row);

}  // namespace maq
