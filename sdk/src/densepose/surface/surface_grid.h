// Where on the body a label lies: a bundle's surface.grid (docs/reference/formats.md).
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace maq {

struct SurfaceGrid {
  int nodes = 0;                // along U, and along V
  std::vector<float> points_m;  // [24][nodes][nodes][3]; NaN where the chart does not reach
};

// `name` names the bytes in errors. Throws MAQ_ERROR_BAD_BUNDLE.
SurfaceGrid decode_surface_grid(const std::vector<uint8_t>& bytes, const std::string& name);

// The grid of a bundle, decoded at the first call of grid(): most programs never make one.
class BodySurface {
 public:
  // The file's verified bytes; none where the bundle has no such file.
  BodySurface(std::vector<uint8_t> bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {}

  // The same at each call, from any thread. Throws MAQ_ERROR_UNSUPPORTED where there is none, MAQ_ERROR_BAD_BUNDLE.
  const SurfaceGrid& grid();

 private:
  std::mutex mutex_;
  std::vector<uint8_t> bytes_;
  std::string name_;
  SurfaceGrid grid_;
};

}  // namespace maq
