#include "app/mapped_frame.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

namespace maquette {
namespace {

constexpr float kMinConfidence = 0.15f;  // of a keypoint that is drawn

void add_skeletons(const DensePoseResult& result, std::vector<std::array<float, 4>>* lines) {
  for (uint32_t person = 0; person < result.person_count(); ++person) {
    std::array<float, 3> keypoints[MAQ_DENSEPOSE_KEYPOINT_COUNT];
    // Without has_keypoints there are none.
    if (maq_densepose_result_get_keypoints(result.get(), person, keypoints[0].data()) != MAQ_OK) return;
    for (const Bone& bone : kSkeleton) {
      const auto& from = keypoints[bone.from];
      const auto& to = keypoints[bone.to];
      if (std::min(from[2], to[2]) >= kMinConfidence) lines->push_back({from[0], from[1], to[0], to[1]});
    }
  }
}

}  // namespace

std::string label_of(const maq_densepose_person& person) {
  char text[40];
  std::snprintf(text, sizeof text, "#%lld %.2f", static_cast<long long>(person.id), double(person.score));
  return text;
}

std::array<float, 25 * 3> part_colours() {
  std::array<float, 25 * 3> colours{};
  for (int32_t part = 0; part < 25; ++part) {
    uint8_t rgb[3];
    maq_densepose_get_part_colour(part, rgb);
    for (size_t channel = 0; channel < 3; ++channel) colours[3 * size_t(part) + channel] = float(rgb[channel]) / 255;
  }
  return colours;
}

void MappedFrame::copy_from(PipelineResult mapped, double rate, std::vector<uint8_t>* seen_before,
                            GrowingTexture* growing) {
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
  if (growing != nullptr) growing->add(densepose, mapped.frame);
  texture = growing != nullptr ? growing->image() : nullptr;
  people = densepose.people();
  skeletons.clear();
  add_skeletons(densepose, &skeletons);
  result = std::make_shared<DensePoseResult>(std::move(densepose));
  stats = result->stats();
  number = mapped.number;
  results_per_second = rate;
  age_ms = mapped.age_ms;
  waiting_ms = mapped.wait_ms;
  copying_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count();
}

}  // namespace maquette
