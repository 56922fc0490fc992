// Extrapolates a frame along its motion.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "prediction/flow/optical_flow.h"
#include "prediction/flow/pixel_warp.h"

namespace maq {

// project() moves a flow field to a later time; warp() fetches the pixels of the later frame along it. When two objects
// land on one pixel, the one that moves unlike the rest of the frame is seen: it is usually in front. Uncovered pixels
// take the displacement of their surroundings.
class Extrapolation {
 public:
  // `flow` points from the newest frame back by one interval; the later frame is `intervals` intervals ahead. Allocates
  // nothing for a known size. The field is valid until the next call.
  const FlowField& project(const FlowField& flow, float intervals);

  // Writes the later frame to `pixels`, packed_bytes() of the image's format and size. One field pixel covers `scale` x
  // `scale` image pixels. Sampling is bilinear and repeats the edges; pixels with displacement 0 are copied. With
  // `weights` the result is blended with `image`. One byte after the image must be readable. No depth images.
  void warp(const ImageView& image, const FlowField& field, int scale, const CellWeights* weights,
            WorkerThreads& threads, uint8_t* pixels);

 private:
  FlowField projected_;
  std::vector<float> priority_;
  std::vector<WarpRow> rows_;  // [workers]
};

}  // namespace maq
