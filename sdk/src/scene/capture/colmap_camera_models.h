// The camera models of COLMAP by name and number.
#pragma once

#include <string_view>

#include "scene/capture/colmap_files.h"

namespace maq {

struct ColmapModelInfo {
  const char* name;
  int number;  // in binary files
  size_t parameters;
};

// In the order of ColmapModel.
inline constexpr ColmapModelInfo kColmapModels[] = {
    {"SIMPLE_PINHOLE", 0, 3}, {"PINHOLE", 1, 4},        {"SIMPLE_RADIAL", 2, 4}, {"RADIAL", 3, 5},
    {"OPENCV", 4, 8},         {"OPENCV_FISHEYE", 5, 8}, {"FULL_OPENCV", 6, 12}};

inline const ColmapModelInfo& info_of(ColmapModel model) { return kColmapModels[size_t(model)]; }

}  // namespace maq
