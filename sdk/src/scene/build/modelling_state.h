// What a modeller knows besides the scene: with it photos can be added to a scene of which only the file is left.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "scene/point_cloud.h"
#include "scene/build/descriptor_regression.h"

namespace maq {

struct ModellingState {
  PointCloud cloud;                  // without colours; points that no photo saw too
  std::vector<uint32_t> seen;        // points that some photo saw
  std::vector<ViewMoments> moments;  // of those, in their order
  uint32_t photos = 0;               // that were added
  std::array<double, 3> up = {0, 0, 1};
  std::array<uint8_t, 32> networks_sha256 = {};  // others understand nothing of it
};

// The same where it lies, without up and networks, which are the scene's. In a file it takes 12 bytes for each point of the
// cloud, and 340 for each that was seen.
struct ModellingStateView {
  PointPlaces cloud;
  const uint32_t* seen = nullptr;
  size_t seen_count = 0;
  std::function<const ViewMoments&(size_t place)> moments;  // of seen[place]
  uint32_t photos = 0;
};

}  // namespace maq
