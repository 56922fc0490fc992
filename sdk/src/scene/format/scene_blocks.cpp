#include "scene/format/scene_blocks.h"

#include <algorithm>
#include <limits>

namespace maq {
namespace {

struct Entry {
  float at[3];
  uint32_t index;
};

// A gap of that fraction of a block's length splits it.
constexpr double kWideGap = 0.75;
constexpr int kMaxGapSplits = 2;  // one after the other: four blocks of one

class BlockSplitter {
 public:
  BlockSplitter(uint32_t max_points, BlockOrder& blocks) : max_points_(max_points), blocks_(blocks) {}

  void split(Entry* begin, Entry* end) {
    const size_t count = size_t(end - begin);
    if (count <= max_points_) return split_gaps(begin, end, kMaxGapSplits);
    const size_t blocks = (count + max_points_ - 1) / max_points_;
    Entry* middle = begin + blocks / 2 * max_points_;
    std::nth_element(begin, middle, end, LessAlongAxis{longest_axis(begin, end)});
    split(begin, middle);
    split(middle, end);
  }

 private:
  // Points at the same position keep their order. Every standard library then splits them alike.
  struct LessAlongAxis {
    int axis;
    bool operator()(const Entry& a, const Entry& b) const {
      return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.index < b.index;
    }
  };

  static int longest_axis(const Entry* begin, const Entry* end) {
    double longest = -1;
    int found = 0;
    for (int axis = 0; axis < 3; ++axis) {
      float low = std::numeric_limits<float>::infinity(), high = -low;
      for (const Entry* entry = begin; entry < end; ++entry) {
        low = std::min(low, entry->at[axis]);
        high = std::max(high, entry->at[axis]);
      }
      const double length = double(high) - low;
      if (length > longest) {
        longest = length;
        found = axis;
      }
    }
    return found;
  }

  void split_gaps(Entry* begin, Entry* end, int splits_left) {
    if (splits_left > 0 && end - begin > 1) {
      const int axis = longest_axis(begin, end);
      std::sort(begin, end, LessAlongAxis{axis});
      double widest = 0;
      Entry* behind = begin;
      for (Entry* entry = begin + 1; entry < end; ++entry) {
        const double gap = double(entry->at[axis]) - entry[-1].at[axis];
        if (gap > widest) {
          widest = gap;
          behind = entry;
        }
      }
      if (widest > kWideGap * (double(end[-1].at[axis]) - begin->at[axis])) {
        split_gaps(begin, behind, splits_left - 1);
        return split_gaps(behind, end, splits_left - 1);
      }
    }
    const size_t first = blocks_.order.size();
    for (const Entry* entry = begin; entry < end; ++entry) blocks_.order.push_back(entry->index);
    std::sort(blocks_.order.begin() + std::ptrdiff_t(first), blocks_.order.end());
    blocks_.ends.push_back(uint32_t(blocks_.order.size()));
  }

  const uint32_t max_points_;
  BlockOrder& blocks_;
};

}  // namespace

void split_into_blocks(const PointPositions& positions, const std::vector<uint32_t>& chosen, uint32_t max_points,
                       BlockOrder& blocks) {
  if (chosen.empty()) return;
  std::vector<Entry> entries;
  entries.reserve(chosen.size());
  for (const uint32_t i : chosen) entries.push_back({{positions.x[i], positions.y[i], positions.z[i]}, i});
  BlockSplitter(max_points, blocks).split(entries.data(), entries.data() + entries.size());
}

}  // namespace maq
