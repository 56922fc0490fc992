#include "densepose/surface/surface_grid.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"

namespace maq {
namespace {

constexpr char kMagic[] = "MAQGRID1";
constexpr size_t kHeadBytes = 40;
constexpr uint32_t kParts = 24;
constexpr uint32_t kMaxNodes = 1024;
constexpr float kMaxDistance_m = 1000;
constexpr uint32_t kLargestValue = 65534;
constexpr uint32_t kOutsideChart = 65535;

uint32_t number_at(const std::vector<uint8_t>& bytes, size_t offset, size_t count) {
  uint32_t number = 0;
  for (size_t i = 0; i < count; ++i) number |= uint32_t(bytes[offset + i]) << 8 * i;
  return number;
}

float float_at(const std::vector<uint8_t>& bytes, size_t offset) {
  const uint32_t bits = number_at(bytes, offset, 4);
  float value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace

SurfaceGrid decode_surface_grid(const std::vector<uint8_t>& bytes, const std::string& name) {
  const auto fail = [&](const auto&... parts) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, name, parts..., " Fetch or export the bundle again.");
  };
  if (bytes.size() < kHeadBytes || std::memcmp(bytes.data(), kMagic, 8) != 0) fail(" is not a surface grid.");
  const uint32_t parts = number_at(bytes, 8, 4), nodes = number_at(bytes, 12, 4);
  const uint64_t points = uint64_t(parts) * nodes * nodes;
  if (parts != kParts || nodes < 2 || nodes > kMaxNodes || bytes.size() != kHeadBytes + 6 * points) {
    fail(" is a damaged surface grid: ", parts, " parts, ", nodes, " nodes a side, ", bytes.size(), " bytes.");
  }
  float low_m[3], high_m[3];
  for (size_t axis = 0; axis < 3; ++axis) {
    low_m[axis] = float_at(bytes, 16 + 4 * axis);
    high_m[axis] = float_at(bytes, 28 + 4 * axis);
    // NaN also makes this false.
    if (!(low_m[axis] >= -kMaxDistance_m && low_m[axis] <= high_m[axis] && high_m[axis] <= kMaxDistance_m)) {
      fail(" is a damaged surface grid: it reaches from ", low_m[axis], " to ", high_m[axis], " m.");
    }
  }
  SurfaceGrid grid;
  grid.nodes = int(nodes);
  grid.points_m.resize(size_t(points) * 3, std::numeric_limits<float>::quiet_NaN());
  for (size_t point = 0; point < points; ++point) {
    uint32_t stored[3];
    for (size_t axis = 0; axis < 3; ++axis) stored[axis] = number_at(bytes, kHeadBytes + 2 * (3 * point + axis), 2);
    if (std::count(stored, stored + 3, kOutsideChart) > 0) continue;
    for (size_t axis = 0; axis < 3; ++axis) {
      grid.points_m[3 * point + axis] = float(double(low_m[axis]) + double(stored[axis]) / kLargestValue *
                                                                        (double(high_m[axis]) - double(low_m[axis])));
    }
  }
  return grid;
}

const SurfaceGrid& BodySurface::grid() {
  std::lock_guard<std::mutex> lock(mutex_);
  if (grid_.nodes > 0) return grid_;
  if (bytes_.empty()) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The model bundle has no surface grid; use one that has.");
  }
  grid_ = decode_surface_grid(bytes_, name_);
  std::vector<uint8_t>().swap(bytes_);
  return grid_;
}

}  // namespace maq
