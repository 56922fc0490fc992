// From the regressions of points to their descriptors.
#pragma once

#include "core/worker_threads.h"
#include "scene/assembly/regression_store.h"
#include "scene/format/fitted_points.h"
#include "scene/point_cloud.h"

namespace maq {

// Appends all points of `regressions` to the arrays of `made`, in their order, and counts singular ones. With
// `forgets`, the regressions are freed on the way.
void solve_descriptors(RegressionStore& regressions, const PointPositions& positions, WorkerThreads& threads,
                       bool forgets, FittedPoints& made);

}  // namespace maq
