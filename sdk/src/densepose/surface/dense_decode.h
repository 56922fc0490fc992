// From the dense head's logits to the planes of a result.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "densepose/detector/box.h"
#include "densepose/surface/chart_predictor.h"
#include "image/crop_input.h"

namespace maq {

// The dense head's output for one person.
struct DenseLogits {
  // [size / 2, size / 2, 2, 2, coarse_classes + index_classes]: four neighbouring cells (rows, then columns) lie
  // together. Class 0 of both kinds is background (the background logit of the index is not read), then come the parts.
  const float* labels = nullptr;
  ChartValues* charts = nullptr;  // U and V of the parts; null: they stay 0
  int coarse_classes = 0;
  int index_classes = 0;
  int size = 0;

  // The classes of a cell: coarse, then index.
  const float* cell(int row, int column) const {
    const size_t four = size_t(row / 2) * size_t(size / 2) + size_t(column / 2);
    return labels + (4 * four + size_t(row % 2 * 2 + column % 2)) * size_t(coarse_classes + index_classes);
  }
};

// One byte a pixel of the image, rows without padding: part, U * 255, V * 255, person.
struct DensePlanes {
  int width_px = 0;
  int height_px = 0;
  std::vector<uint8_t> part, u, v, person;

  void reset(int width, int height);
};

// Around the pixels of a person, counted from 1, that show the head (parts 23 and 24); nothing without any.
std::optional<Box> head_bounds(const DensePlanes& planes, uint8_t person);

struct DecodeCounts {
  int64_t body_pixels = 0;
  int64_t won_pixels = 0;  // of these: belonged to other people before
  int64_t clamped_uv = 0;
};

// Where a pixel lies between two cells along one axis.
struct ResizeTap {
  int low = 0;
  int high = 0;
  float fraction = 0;  // weight of `high`
};

// Scratch memory of painting a person; kept from person to person, and from frame to frame.
struct DecodeMemory {
  std::vector<ResizeTap> rows, columns;
  std::vector<float> odds;       // of each cell: log(p / (1 - p)), p the probability that it shows the person
  std::vector<int16_t> best;     // of each cell the part, from 0; -1: none
  std::vector<float> mixed_row;  // logits of a row of cells
  struct Pixel {
    int x = 0, y = 0;
  };
  std::vector<int8_t> painted_odds;        // of each pixel that shows a person: the person's log-odds, in eighths
  std::array<int64_t, 256> pixel_count{};  // of each person
  std::array<int64_t, 256> lost_count{};   // of each person, to the person who is painted
  std::vector<Pixel> won;                  // by the person who is painted
};

// The pixels a box is painted into: between the floors of its corners, at least one each way.
struct PixelRect {
  int x = 0, y = 0, width = 1, height = 1;
};
PixelRect pixel_rect(const Box& box);

// Fills `memory.odds` and `memory.best`.
void classify_cells(const DenseLogits& logits, DecodeMemory& memory);
// The mean probability of the best part, over the cells that show the person; 0 where none does. `memory` holds the
// classified cells of `logits`.
float part_confidence(const DenseLogits& logits, float mask_threshold, const DecodeMemory& memory);
// The log-odds above which a cell or pixel shows the person.
float min_log_odds(float mask_threshold);

// Paints where the coarse classes other than background together have a probability above `mask_threshold` (log-odds of
// each cell, resized bilinearly with half-pixel centres to the box's pixels): the best part of the index logits,
// resized alike (of equal ones the lowest; background is not among them), with its U and V, resized alike and clamped
// to [0, 1]. Pixels outside the image are left alone. `person` counts from 1. All people of an image need the same
// `memory`. Where two people meet:
// - If other people have more than 1 - `min_visible_fraction` of the person's pixels, nothing is painted.
// - Otherwise a pixel goes to the person with the higher log-odds there (in eighths, up to 16), of equals to the first.
//   But nobody is left with less than `min_visible_fraction` of its pixels.
DecodeCounts paint_person(const DenseLogits& logits, const Box& box, uint8_t person, float mask_threshold,
                          float min_visible_fraction, DecodeMemory& memory, DensePlanes& planes);

// Paints a person with a box that is rotated in the image, like paint_person(): `to_cells` maps positions of the image
// to the cells of the logits; cell (0, 0) covers [0, 1) x [0, 1). Paints the pixels whose centres lie in the cells.
DecodeCounts paint_rotated_person(const DenseLogits& logits, const AffineMap& to_cells, uint8_t person,
                                  float mask_threshold, float min_visible_fraction, DecodeMemory& memory,
                                  DensePlanes& planes);

}  // namespace maq
