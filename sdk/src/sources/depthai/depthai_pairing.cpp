#include "sources/depthai/depthai_pairing.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <tuple>

namespace maq {
namespace {

// Depth comes some tens of milliseconds after its image: the device computes it.
constexpr int64_t kMinWaitNs = 100'000'000;
constexpr int kMaxWaitPeriods = 3;
constexpr size_t kMaxWaiting = 16;
// Bounds of a believable time: how old a frame can be when it arrives, and how far the clocks can be apart.
constexpr int64_t kMaxAgeNs = 10'000'000'000;
constexpr int64_t kMaxFutureNs = 100'000'000;

}  // namespace

DepthAiPairing::DepthAiPairing(double fps, bool with_depth) : with_depth_(with_depth) {
  const double period_ns = 1e9 / std::clamp(fps, 0.01, 1000.0);
  half_period_ns_ = int64_t(period_ns / 2);
  max_wait_ns_ = std::max(kMinWaitNs, int64_t(kMaxWaitPeriods * period_ns));
  capacity_ = std::min(kMaxWaiting, 2 + size_t(std::ceil(double(max_wait_ns_) / period_ns)));
}

void DepthAiPairing::add_colour(DepthAiFrame frame, int64_t now_ns) {
  keep(colour_, waiting(std::move(frame), now_ns));
}

void DepthAiPairing::add_depth(DepthAiFrame frame, int64_t now_ns) { keep(depth_, waiting(std::move(frame), now_ns)); }

std::optional<DepthAiPair> DepthAiPairing::next(int64_t now_ns) {
  if (colour_.empty()) return {};
  const Waiting& colour = colour_.front();
  depth_.erase(
      std::remove_if(depth_.begin(), depth_.end(), [&](const Waiting& depth) { return is_before(depth, colour); }),
      depth_.end());
  const auto distance = [&](const Waiting& depth) {
    const bool timed = depth.has_time && colour.has_time;
    return std::tuple(timed ? std::abs(depth.frame.timestamp_ns - colour.frame.timestamp_ns) : 0,
                      depth.frame.sequence != colour.frame.sequence);
  };
  auto nearest = depth_.end();
  bool can_still_come = with_depth_ && now_ns < colour.arrived_ns + max_wait_ns_;
  for (auto depth = depth_.begin(); depth != depth_.end(); ++depth) {
    if (is_past(*depth, colour)) {
      can_still_come = false;
    } else if (nearest == depth_.end() || distance(*depth) < distance(*nearest)) {
      nearest = depth;
    }
  }
  if (nearest == depth_.end() && can_still_come) return {};
  DepthAiPair pair;
  if (nearest != depth_.end()) {
    pair.depth = std::move(nearest->frame);
    depth_.erase(nearest);
  }
  pair.colour = std::move(colour_.front().frame);
  colour_.pop_front();
  return pair;
}

int64_t DepthAiPairing::due_ns() const {
  return colour_.empty() ? INT64_MAX : colour_.front().arrived_ns + (with_depth_ ? max_wait_ns_ : 0);
}

void DepthAiPairing::clear() {
  colour_.clear();
  depth_.clear();
}

DepthAiPairing::Waiting DepthAiPairing::waiting(DepthAiFrame frame, int64_t now_ns) {
  const bool has_time = frame.timestamp_ns >= now_ns - kMaxAgeNs && frame.timestamp_ns <= now_ns + kMaxFutureNs;
  if (!has_time) frame.timestamp_ns = now_ns;
  return {std::move(frame), now_ns, has_time};
}

void DepthAiPairing::keep(std::deque<Waiting>& queue, Waiting entry) const {
  if (queue.size() == capacity_) queue.pop_front();
  queue.push_back(std::move(entry));
}

bool DepthAiPairing::is_past(const Waiting& depth, const Waiting& colour) const {
  if (!depth.has_time || !colour.has_time) return depth.frame.sequence > colour.frame.sequence;
  return depth.frame.timestamp_ns - colour.frame.timestamp_ns > half_period_ns_;
}

bool DepthAiPairing::is_before(const Waiting& depth, const Waiting& colour) const {
  if (!depth.has_time || !colour.has_time) return depth.frame.sequence < colour.frame.sequence;
  return colour.frame.timestamp_ns - depth.frame.timestamp_ns > half_period_ns_;
}

}  // namespace maq
