// What an import left out, and why.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace maq {

// Reads as "12 photos that are not in their folder (first: images/0007.jpg)".
struct Dropped {
  std::string reason;
  size_t count = 0;
  std::string first;  // name of the first one; "" for things without names
};

class DropCounts {
 public:
  void add(const std::string& reason, const std::string& name = "", size_t count = 1) {
    if (count == 0) return;
    for (Dropped& dropped : list_) {
      if (dropped.reason != reason) continue;
      dropped.count += count;
      return;
    }
    constexpr size_t kMostNameBytes = 200;
    list_.push_back({reason, count, name.substr(0, kMostNameBytes)});
  }

  // In the order in which the reasons came up first.
  const std::vector<Dropped>& list() const { return list_; }

 private:
  std::vector<Dropped> list_;
};

inline std::string sentence_part(const Dropped& dropped) {
  const std::string text = std::to_string(dropped.count) + " " + dropped.reason;
  return dropped.first.empty() ? text : text + " (first: " + dropped.first + ")";
}

}  // namespace maq
