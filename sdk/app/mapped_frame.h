// A frame and its labels, as textures take them.
#pragma once

#include <array>
#include <cstdint>
#include <maquette/maquette.hpp>
#include <memory>
#include <string>
#include <vector>

#include "app/growing_texture.h"
#include "app/rgba_image.h"

namespace maquette {

// Id and score, as "#7 0.98".
std::string label_of(const maq_densepose_person& person);
// Red, green and blue of parts 0 to 24, from 0 to 1.
std::array<float, 25 * 3> part_colours();

struct MappedFrame {
  static constexpr size_t kSeenCells = 16;  // of each chart, along U and along V

  RgbaImage camera;
  std::vector<uint8_t> iuv;   // 4 bytes a pixel: part, U, V, person
  std::vector<uint8_t> seen;  // [24][V][U] cells of the body: 255 in this frame, less the longer ago
  std::vector<maq_densepose_person> people;
  std::vector<std::array<float, 4>> skeletons;  // lines in pixels: x, y of both ends; empty without keypoints
  std::shared_ptr<const RgbaImage> texture;     // of one person; null without
  std::shared_ptr<const DensePoseResult> result;
  maq_densepose_stats stats{};
  double waiting_ms = 0, copying_ms = 0, age_ms = -1, results_per_second = 0;
  uint64_t number = 0;  // 0: none yet

  // `seen_before`: of the frame before, and then of this one. `growing`: takes the frame; may be null.
  void copy_from(PipelineResult mapped, double rate, std::vector<uint8_t>* seen_before,
                 GrowingTexture* growing = nullptr);
};

}  // namespace maquette
