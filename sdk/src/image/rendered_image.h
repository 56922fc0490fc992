// A rendered image of a scene or a mesh, with depth and more for each pixel.
#pragma once

#include <cstdint>
#include <vector>

namespace maq {

// Planes row by row, without padding; memory is kept between uses.
struct RenderedImage {
  // Makes room for colours, alpha and depth, whose content is then undefined, and empties the rest.
  void set_size(int width, int height) {
    const size_t pixels = size_t(width) * size_t(height);
    width_px = width;
    height_px = height;
    bgr.resize(3 * pixels);
    alpha.resize(pixels);
    depth.resize(pixels);
    normals.clear();
    template_points.clear();
  }

  int width_px = 0, height_px = 0;
  std::vector<uint8_t> bgr;
  std::vector<uint8_t> alpha;  // coverage: 0 where nothing is
  std::vector<float> depth;    // along the optical axis; 0 where nothing is
  // Empty for scenes; 0 where nothing is.
  std::vector<float> normals;          // x, y, z in the camera, of length 1
  std::vector<float> template_points;  // x, y, z on the template head; empty where the mesh has none
};

}  // namespace maq
