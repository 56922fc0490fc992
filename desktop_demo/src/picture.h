// A picture in memory, as textures take it.
#pragma once

#include <cstdint>
#include <vector>

struct Picture {
  int width_px = 0, height_px = 0;
  std::vector<uint8_t> rgba;  // rows from top to bottom, 4 bytes a pixel

  void resize(int width, int height) {
    width_px = width, height_px = height;
    rgba.resize(size_t(width) * size_t(height) * 4);
  }
  bool empty() const { return rgba.empty(); }
};
