// A picture as it will look if everything goes on moving as it does.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "prediction/optical_flow.h"
#include "prediction/pixel_fetch.h"

namespace maq {

// Where the pixels of a coming picture come from. `flow` says where the things in the newest picture were one interval
// before, `intervals` how many intervals the coming picture is later. What moves is moved on, and where two things come
// to one place the one that moves unlike the rest of the picture is seen: it is mostly in front. Where nothing comes to
// lie, what was behind appears, and the surroundings stretch over it.
class Extrapolation {
 public:
  // Takes nothing from the heap for fields of a size that was there before. The field stays until the next call.
  const FlowField& project(const FlowField& flow, float intervals);

  // Fetches each pixel of a coming picture from `image` along `field`, whose pixels are `scale` pixels of it each way;
  // bilinear, beyond the edges the last pixels. `pixels`: memory of packed_bytes() of the image's format and size. No
  // depth image. Where the field is 0 pixels are copied. A byte behind the image's last must be readable. With
  // `weights` the picture is a mix of what is fetched and the image as it is.
  void fetch(const ImageView& image, const FlowField& field, int scale, const CellWeights* weights,
             WorkerThreads& threads, uint8_t* pixels);

 private:
  FlowField projected_;
  std::vector<float> priority_;
  std::vector<FetchRow> rows_;  // of a worker each
};

}  // namespace maq
