#include "app/mapped_frame.h"

#include <chrono>
#include <utility>

namespace maquette {

void MappedFrame::copy_from(PipelineResult mapped, double rate, std::vector<uint8_t>* seen_before) {
  const auto before = std::chrono::steady_clock::now();
  camera.copy_from(mapped.frame);
  DensePoseResult densepose = densepose_of(mapped);
  iuv.resize(camera.rgba.size());
  const maq_densepose_plane planes[] = {MAQ_DENSEPOSE_PLANE_PART, MAQ_DENSEPOSE_PLANE_U, MAQ_DENSEPOSE_PLANE_V,
                                        MAQ_DENSEPOSE_PLANE_PERSON};
  for (size_t channel = 0; channel < 4; ++channel) {
    size_t stride_bytes = 0;
    const uint8_t* from = densepose.plane(planes[channel], &stride_bytes);
    uint8_t* to = iuv.data() + channel;
    for (int y = 0; y < camera.height_px; ++y, from += stride_bytes) {
      for (int x = 0; x < camera.width_px; ++x, to += 4) *to = from[x];
    }
  }
  // Seen cells fade within a second or so.
  seen_before->resize(24 * kSeenCells * kSeenCells);
  for (uint8_t& cell : *seen_before) cell = uint8_t(cell * 15 / 16);
  for (size_t at = 0; at < iuv.size(); at += 4) {
    if (iuv[at] == 0) continue;
    const size_t chart = iuv[at] - 1u, u = iuv[at + 1] * kSeenCells / 256, v = iuv[at + 2] * kSeenCells / 256;
    (*seen_before)[(chart * kSeenCells + v) * kSeenCells + u] = 255;
  }
  seen = *seen_before;
  people = densepose.people();
  result = std::make_shared<DensePoseResult>(std::move(densepose));
  stats = result->stats();
  number = mapped.number;
  results_per_second = rate;
  age_ms = mapped.age_ms;
  waiting_ms = mapped.wait_ms;
  copying_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count();
}

}  // namespace maquette
