#include "edges/fusion/point_grid.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr double kFine = 256;
constexpr int kBits = 21;  // bits of a coordinate in a key
constexpr int64_t kHalf = int64_t(1) << (kBits - 1);
constexpr size_t kFirstSlots = 1 << 12;
// More points in one cell add nothing, and this limit keeps the sums in range.
constexpr uint32_t kMaxCount = 1 << 22;

size_t hash_of(uint64_t key) {
  key ^= key >> 31;
  key *= 0x9E3779B97F4A7C15u;
  return size_t(key ^ (key >> 29));
}

}  // namespace

PointGrid::PointGrid(double cell_m, size_t limit) : cell_m_(cell_m), limit_(limit) { rebuild(kFirstSlots); }

void PointGrid::rebuild(size_t slots) {
  slots_.assign(slots, 0);
  for (size_t i = 0; i < cells_.size(); ++i) {
    size_t at = hash_of(cells_[i].key) & (slots - 1);
    while (slots_[at] != 0) at = (at + 1) & (slots - 1);
    slots_[at] = uint32_t(i + 1);
  }
}

PointGrid::Cell* PointGrid::find_or_add(uint64_t key) {
  size_t at = hash_of(key) & (slots_.size() - 1);
  for (; slots_[at] != 0; at = (at + 1) & (slots_.size() - 1)) {
    if (cells_[slots_[at] - 1].key == key) return &cells_[slots_[at] - 1];
  }
  if (cells_.size() >= limit_) return nullptr;
  cells_.push_back({key});
  slots_[at] = uint32_t(cells_.size());
  if (2 * cells_.size() > slots_.size()) rebuild(2 * slots_.size());
  return &cells_.back();
}

PointGrid::Added PointGrid::add(Vec3 point, Vec3 normal, double r_m) {
  const double place[3] = {point.x / cell_m_, point.y / cell_m_, point.z / cell_m_};
  const double direction[3] = {normal.x, normal.y, normal.z};
  uint64_t key = 0;
  std::array<int64_t, 3> offset{};
  for (size_t i = 3; i-- > 0;) {
    const double corner = std::floor(place[i]);
    if (!(corner >= -double(kHalf) && corner < double(kHalf))) return Added::kOutside;
    key = key << kBits | uint64_t(int64_t(corner) + kHalf);
    offset[i] = int64_t((place[i] - corner) * kFine);
  }
  Cell* const cell = find_or_add(key);
  if (cell == nullptr) return Added::kFull;
  cell->r_m = cell->count == 0 ? float(r_m) : std::min(cell->r_m, float(r_m));
  if (cell->count == kMaxCount) return Added::kYes;
  for (size_t i = 0; i < 3; ++i) {
    cell->offset[i] += offset[i];
    cell->normal[i] += int32_t(std::nearbyint(direction[i] * kFine));
  }
  ++cell->count;
  return Added::kYes;
}

const std::vector<PointGrid::Cell>& PointGrid::sorted() {
  slots_ = {};
  std::sort(cells_.begin(), cells_.end(), [](const Cell& a, const Cell& b) { return a.key < b.key; });
  return cells_;
}

Vec3 PointGrid::point(const Cell& cell) const {
  double place[3];
  for (int i = 0; i < 3; ++i) {
    const auto corner = double(int64_t(cell.key >> (kBits * i) & ((uint64_t(1) << kBits) - 1)) - kHalf);
    // Half a step more, because offsets are rounded down.
    place[i] = corner + (double(cell.offset[size_t(i)]) / cell.count + 0.5) / kFine;
  }
  return cell_m_ * Vec3{place[0], place[1], place[2]};
}

Vec3 PointGrid::normal(const Cell& cell) const {
  const double scale = 1 / (kFine * cell.count);
  return scale * Vec3{double(cell.normal[0]), double(cell.normal[1]), double(cell.normal[2])};
}

}  // namespace maq
