// Labels that do not flicker: in a stream, a cell keeps its label until another one is clearly more likely.
#pragma once

#include <cstdint>
#include <vector>

#include "densepose/surface/dense_decode.h"
#include "image/crop_input.h"

namespace maq {

// Keeps the labels of the people of one frame for the next. Cells are compared with cells of the same view alone: where
// a person moves, the view moves too, and nothing old is left.
class SteadyLabels {
 public:
  // Begins a frame. Without `is_stream` the frames before count no longer.
  void begin(bool is_stream);
  // Favours the labels that this view had in the previous frame: changes `labels`, which `logits` shows. `view`: from
  // the image to the cells. Does nothing for another view.
  void favour(const AffineMap& view, const DenseLogits& logits, float* labels) const;
  // Keeps the labels of a person who was painted. `painted` holds the classified cells.
  void keep(const AffineMap& view, float mask_threshold, const DecodeMemory& painted);

 private:
  struct Kept {
    AffineMap view;
    std::vector<int16_t> parts;  // of each cell, from 0; -1: background
  };

  std::vector<Kept> previous_, current_;  // memory is reused: the first so many count
  size_t previous_count_ = 0, current_count_ = 0;
};

}  // namespace maq
