// Pairs the images of a DepthAI device with their depth images: two streams that arrive apart become one.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "sources/depthai/depthai_session.h"

namespace maq {

// An image, with its depth where that came in time.
struct DepthAiPair {
  DepthAiFrame colour;
  std::optional<DepthAiFrame> depth;
};

// Time decides, not the number: the cameras of a device count from where each of them began. The nearest depth image
// that is at most half a frame period away is the image's; of two that are as near, the one of the same number. Where
// a device gives no times, equal numbers pair. All times are CLOCK_MONOTONIC.
class DepthAiPairing {
 public:
  DepthAiPairing(double fps, bool with_depth);

  // The oldest that wait make room for new ones.
  void add_colour(DepthAiFrame frame, int64_t now_ns);
  void add_depth(DepthAiFrame frame, int64_t now_ns);

  // The oldest image, once its depth is there, cannot come any more, or is too late.
  std::optional<DepthAiPair> next(int64_t now_ns);
  // When next() has something even if nothing is added; INT64_MAX for never.
  int64_t due_ns() const;

  void clear();

 private:
  struct Waiting {
    DepthAiFrame frame;
    int64_t arrived_ns;
    bool has_time;
  };

  static Waiting waiting(DepthAiFrame frame, int64_t now_ns);
  void keep(std::deque<Waiting>& queue, Waiting entry) const;
  // Depth of a later or an earlier image.
  bool is_past(const Waiting& depth, const Waiting& colour) const;
  bool is_before(const Waiting& depth, const Waiting& colour) const;

  bool with_depth_;
  int64_t half_period_ns_;
  int64_t max_wait_ns_;
  size_t capacity_;
  std::deque<Waiting> colour_, depth_;
};

}  // namespace maq
