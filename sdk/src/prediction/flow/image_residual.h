// Adds a small RGB residual to a large image in its own pixel format.
#pragma once

#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"

namespace maq {

class ImageResidual {
 public:
  // `residual`: [side][side][3], R, G, B in levels of 0..255, resized to the whole image by bilinear interpolation.
  // `pixels`: packed memory of an image of this format and size, where the sums are written, clamped to 0..255.
  // Residuals below half a level change nothing. No depth images.
  void add(const float* residual, int side, const ImageView& image, WorkerThreads& threads, uint8_t* pixels);

 private:
  struct Row {
    std::vector<float> between;  // [side]: two residual rows, interpolated
    std::vector<float> wide;     // [width]
  };
  std::vector<float> channels_;  // [channels][side][side], in the image's colours
  std::vector<Row> rows_;        // [workers]
};

}  // namespace maq
