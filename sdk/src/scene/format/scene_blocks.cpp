#include "scene/format/scene_blocks.h"

#include <algorithm>
#include <limits>

namespace maq {
namespace {

struct Entry {
  float at[3];
  uint32_t index;
};

// A gap of that share of a block's length is cut.
constexpr double kWideGap = 0.75;
constexpr int kMostGapCuts = 2;  // one after the other: four blocks of one

class Cutter {
 public:
  Cutter(uint32_t most_points, BlockOrder& blocks) : most_points_(most_points), blocks_(blocks) {}

  void cut(Entry* begin, Entry* end) {
    const size_t count = size_t(end - begin);
    if (count <= most_points_) return cut_gaps(begin, end, kMostGapCuts);
    const size_t blocks = (count + most_points_ - 1) / most_points_;
    Entry* middle = begin + blocks / 2 * most_points_;
    std::nth_element(begin, middle, end, Before{longest_axis(begin, end)});
    cut(begin, middle);
    cut(middle, end);
  }

 private:
  // Of points in the same place the first comes first, so that every library cuts them alike.
  struct Before {
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

  void cut_gaps(Entry* begin, Entry* end, int cuts_left) {
    if (cuts_left > 0 && end - begin > 1) {
      const int axis = longest_axis(begin, end);
      std::sort(begin, end, Before{axis});
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
        cut_gaps(begin, behind, cuts_left - 1);
        return cut_gaps(behind, end, cuts_left - 1);
      }
    }
    const size_t first = blocks_.order.size();
    for (const Entry* entry = begin; entry < end; ++entry) blocks_.order.push_back(entry->index);
    std::sort(blocks_.order.begin() + std::ptrdiff_t(first), blocks_.order.end());
    blocks_.ends.push_back(uint32_t(blocks_.order.size()));
  }

  const uint32_t most_points_;
  BlockOrder& blocks_;
};

}  // namespace

void cut_into_blocks(const PointPlaces& places, const std::vector<uint32_t>& chosen, uint32_t most_points,
                     BlockOrder& blocks) {
  if (chosen.empty()) return;
  std::vector<Entry> entries;
  entries.reserve(chosen.size());
  for (const uint32_t i : chosen) entries.push_back({{places.x[i], places.y[i], places.z[i]}, i});
  Cutter(most_points, blocks).cut(entries.data(), entries.data() + entries.size());
}

}  // namespace maq
