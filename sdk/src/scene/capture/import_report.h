// The dropped parts of an import, with reasons.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace maq {

// Reads as "12 photos that are not in their folder (first: images/0007.jpg)".
struct Dropped {
  std::string reason;
  size_t count = 0;
  std::string first;  // name of the first one; "" if it has no name

  std::string reason_and_first() const { return first.empty() ? reason : reason + " (first: " + first + ")"; }
};

class ImportReport {
 public:
  void add(const std::string& reason, const std::string& name = "", size_t count = 1) {
    if (count == 0) return;
    for (Dropped& dropped : list_) {
      if (dropped.reason != reason) continue;
      dropped.count += count;
      return;
    }
    constexpr size_t kMaxNameBytes = 200;
    list_.push_back({reason, count, name.substr(0, kMaxNameBytes)});
  }

  // In the order in which the reasons came up first.
  const std::vector<Dropped>& list() const { return list_; }

 private:
  std::vector<Dropped> list_;
};

inline std::string describe(const Dropped& dropped) {
  return std::to_string(dropped.count) + " " + dropped.reason_and_first();
}

// As part of a sentence: "3 photos that cannot be read as images (first: a.jpg), 1 photos without a camera"; "" for
// none.
inline std::string describe(const std::vector<Dropped>& list) {
  std::string text;
  for (const Dropped& dropped : list) text += (text.empty() ? "" : ", ") + describe(dropped);
  return text;
}

}  // namespace maq
