// A frame and its labels, as textures take them.
#pragma once

#include <app/live_densepose.h>
#include <app/rgba_image.h>
#include <memory>
#include <vector>

struct MappedFrame {
  static constexpr size_t kSeenCells = 16;  // of each chart, along U and along V

  maquette::RgbaImage camera;
  std::vector<uint8_t> iuv;   // 4 bytes a pixel: part, U, V, person
  std::vector<uint8_t> seen;  // [24][V][U] cells of the body: 255 in this frame, less the longer ago
  std::vector<maq_person> people;
  std::shared_ptr<const maquette::DensePoseResult> result;
  maq_densepose_stats stats{};
  double waiting_ms = 0, copying_ms = 0, age_ms = -1, results_per_second = 0;
  uint64_t number = 0;  // 0: none yet

  // `seen_before`: of the frame before, and then of this one.
  void copy_from(maquette::PipelineResult mapped, double rate, std::vector<uint8_t>* seen_before);
};
