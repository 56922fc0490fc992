// The pixels of a picture fetched from another along a field of displacements: the loops over pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/optical_flow.h"
#include "prediction/plane_samples.h"

namespace maq {

// How much of each cell of a picture is fetched, the rest being what was there: 0 to 1, between cells interpolated.
struct CellWeights {
  int columns = 0, rows = 0;
  int cell_px = 1;  // each way, in pixels of a field
  std::vector<float> weights;
  float mean = 0;
};

// Of a row of the picture: how far each pixel's origin is, and that as a pixel with the weights (of 256) of the one to
// its right and the one below. Memory that is used again.
struct FetchRow {
  std::vector<float> upper_dx, upper_dy;  // between two rows of the field
  std::vector<float> dx, dy;
  std::vector<int> left, right, x_weight, above, below, y_weight;
  std::vector<float> cell_weights, weights;  // between two rows of cells; of each pixel, of 256
  std::vector<uint16_t> byte_weights;
};

// Row `y` of a plane, along a field whose pixels are `scale` pixels of the frame each way. A byte behind the last of
// `from` is read where pixels have three.
void fetch_row(const PlaneSamples& plane, const FlowField& field, int scale, int y, FetchRow& row);

// Mixes a row that was fetched with the same pixels of `from`.
void mix_row(const PlaneSamples& plane, const CellWeights& weights, int scale, int y, FetchRow& row);

}  // namespace maq
