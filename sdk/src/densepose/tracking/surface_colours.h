// Mean colours of regions of the body, as far as they were seen: how a person looks.
#pragma once

#include <array>
#include <vector>

#include "core/frame.h"
#include "densepose/surface/dense_decode.h"

namespace maq {

// Colours are Y, Cb and Cr (BT.601), 0 to 255.
struct SurfaceColours {
  struct Region {
    std::array<float, 3> colour{};  // mean
    float samples = 0;              // how many pixels it is the mean of, at most kMaxSamples
  };
  // Torso, hands, feet, upper and lower legs, upper and lower arms, head: of both sides, from the front and from
  // behind.
  static constexpr int kRegions = 8;
  // Older pixels count less once this many were seen.
  static constexpr float kMaxSamples = 1000;

  std::array<Region, size_t(kRegions)> regions;

  // Adds what another frame shows of the same person.
  void add(const SurfaceColours& seen);
};

// 0: the same colours on all regions that both show; 1: as different as clothes can be. `shared`: how much of the body
// both show, 0 to 1; at 0 nothing can be said.
struct ColourDifference {
  float distance = 0;
  float shared = 0;
};
ColourDifference difference(const SurfaceColours& a, const SurfaceColours& b);

// Reads the colours of `people` people, counted from 1 in `planes`, at a grid of pixels. `image` has the planes' size.
void read_colours(const ImageView& image, const DensePlanes& planes, size_t people,
                  std::vector<SurfaceColours>& colours);

}  // namespace maq
