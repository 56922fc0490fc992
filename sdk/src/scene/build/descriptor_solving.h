// From what is known of points to their looks.
#pragma once

#include "core/worker_threads.h"
#include "scene/build/regression_store.h"
#include "scene/format/fitted_points.h"
#include "scene/point_cloud.h"

namespace maq {

// Appends all points of `moments` to the arrays of `made`, in their order, and counts who is singular. With `forgets`,
// what is known of them is given back on the way.
void solve_looks(MomentStore& moments, const PointPlaces& places, WorkerThreads& threads, bool forgets,
                 ModelledPoints& made);

}  // namespace maq
