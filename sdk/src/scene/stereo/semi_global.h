// Depth of each pixel from matching costs, smooth along the four ways to its neighbours: semi-global matching
// (Hirschmueller, "Stereo processing by semiglobal matching and mutual information", PAMI 2008, section 2.3).
#pragma once

#include <vector>

#include "core/worker_threads.h"
#include "scene/stereo/matching_cost.h"

namespace maq {

class SemiGlobal {
 public:
  // `depth`: of each pixel along the optical axis, 0 where no plane fits better than the first and the last. Between
  // planes a parabola through the costs is at its lowest.
  void solve(const MatchingCost& costs, const DepthPlanes& planes, WorkerThreads& threads, std::vector<float>& depth);

 private:
  std::vector<uint8_t> sums_;
};

}  // namespace maq
