// A frame and what was found in it, as textures take it.
#pragma once

#include <app/live_densepose.hpp>
#include <app/rgba_image.hpp>
#include <memory>
#include <vector>

struct MappedFrame {
  static constexpr size_t kSeenCells = 16;  // of each chart, along U and along V

  maquette::Picture camera;
  std::vector<uint8_t> iuv;   // 4 bytes a pixel: part, U, V, person
  std::vector<uint8_t> seen;  // [24][V][U] cells of the body: 255 in this frame, less the longer ago
  std::vector<maq_person> people;
  std::shared_ptr<maquette::DensePoseResult> result;
  maq_densepose_stats stats{};
  double waiting_ms = 0, copying_ms = 0, age_ms = -1, fps = 0;
  uint64_t number = 0;  // 0: none yet

  // `seen_before`: of the frame before, and then of this one.
  void take_over(const maquette::LiveFrame& mapped, std::vector<uint8_t>* seen_before);
};
