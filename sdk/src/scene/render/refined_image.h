// The refiner's output as bytes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/worker_threads.h"
#include "scene/render/descriptor_raster.h"

namespace maq {

// The target of a window's image: rows of `columns` pixels, of which those from (left, top) on are the window's. Parts
// of the window outside of it are left out.
struct ImageRows {
  uint8_t* bgr = nullptr;
  uint8_t* alpha = nullptr;
  float* depth = nullptr;
  int columns = 0, rows = 0;
};

class RefinedImage {
 public:
  // `refined` is the result of SceneNetworks::refine() for the window (RGB, 0..1, clamped here; NaN becomes 0).
  // `alphas` and `depths`, of the window too, are copied. The image is blended over `background` (BGR) by `alphas`
  // times `confidence_gain`, clamped.
  void write(const float* refined, const RefinerLayout& layout, const RasterWindow& window, const uint8_t* alphas,
             const float* depths, const std::array<uint8_t, 3>& background, int confidence_gain, const ImageRows& to,
             WorkerThreads& threads);

 private:
  std::vector<std::vector<uint8_t>> bytes_;  // of two rows, for each worker
};

}  // namespace maq
