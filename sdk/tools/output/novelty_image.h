// Draws the novelty of a frame: its map, its reconstruction, and the curve over time.
#pragma once

#include <deque>
#include <maquette/maquette.hpp>
#include <vector>

#include "output/canvas.h"

class NoveltyImage {
 public:
  // Returns an image: the frame with novel cells in red, its reconstruction, and below them the bits of all frames
  // with their events. All images have the size of the first.
  Canvas draw(const maquette::Frame& frame, const maquette::Frame& reconstruction, const maq_novelty_score& score,
              const std::vector<float>& map);

 private:
  void draw_curve(Canvas& strip) const;

  PictureSide half_;  // of the frame and of its reconstruction
  std::deque<maq_novelty_score> scores_;
};
