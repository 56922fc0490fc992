// A small difference between pictures, added to a large one in its own format.
#pragma once

#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"

namespace maq {

class PictureDifference {
 public:
  // `difference`: R, G, B of [side][side], in grey levels of 0..255, stretched over the whole picture. `pixels`: packed
  // memory of an image of this format and size (not depth), where the sums go; they are limited to what a byte holds.
  // Where the difference is less than half a level nothing changes.
  void add(const float* difference, int side, const ImageView& image, WorkerThreads& threads, uint8_t* pixels);

 private:
  struct Row {
    std::vector<float> between;  // [channels][side]: two rows of the difference, mixed
    std::vector<float> wide;     // [width]
  };
  std::vector<float> channels_;  // [channels][side][side], as the format has them
  std::vector<Row> rows_;        // of each worker
};

}  // namespace maq
