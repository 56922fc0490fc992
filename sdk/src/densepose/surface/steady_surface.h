// A surface that does not flicker: in a stream, the answers of the dense head are averaged along the motion of people.
#pragma once

#include <cstdint>
#include <vector>

#include "densepose/surface/dense_decode.h"
#include "densepose/surface/frame_motion.h"
#include "image/crop_input.h"

namespace maq {

class SteadySurface {
 public:
  // steadiness: how much the frames before count, from 0 (not at all) to below 1.
  explicit SteadySurface(float steadiness) : steadiness_(steadiness) {}

  // Begins a frame. Without `follows_last`, the frames before count no longer.
  void begin(const ImageView& image, bool follows_last);
  // Mixes what the frames before say of a person into the answer: `labels`, which `logits` shows, and `surface`
  // [size / 2, size / 2, channels]. Keeps the result for the next frame. `to_cells`: from the image to the cells.
  // Each cell is compared with the place in the previous frame that its content has come from, if a person was seen
  // there in a similar view; where the image or the outline has changed, the new answer counts alone.
  void steady(const AffineMap& to_cells, const DenseLogits& logits, float* labels, float* surface, int channels);

 private:
  // The answer of a person.
  struct Answer {
    AffineMap to_cells;
    int size = 0;
    std::vector<float> labels, surface;
    std::vector<float> odds;  // of a person, by cell, row by row
  };
  // The answer of the frame before for a cell: a weighted mean of four values that lie at `from`. `share`: how much it
  // counts.
  struct Source {
    size_t from[4];
    float weights[4];
    float share;
  };

  const Answer* similar_to(const AffineMap& to_cells, int size) const;
  void find_sources(const AffineMap& to_cells, const DenseLogits& logits, const Answer& before);

  float steadiness_;
  FrameMotion motion_;
  std::vector<Answer> previous_, current_;  // memory is reused: the first so many count
  size_t previous_count_ = 0, current_count_ = 0;
  std::vector<Source> of_labels_, of_surface_;  // by cell of the labels and of the surface
  std::vector<float> odds_;                     // of the new answer
  std::vector<uint8_t> is_placed_;              // by cell of the surface: has a source
};

}  // namespace maq
