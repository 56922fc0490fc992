// From what is known of points to their looks.
#pragma once

#include "core/worker_threads.h"
#include "scene/format/fitted_points.h"
#include "scene/build/regression_store.h"
#include "scene/visibility/visible_points.h"

namespace maq {

// Appends all points of `moments` to the arrays of `made`, in their order, and counts who is singular. With `forgets`,
// what is known of them is given back on the way.
void solve_looks(MomentStore& moments, const PointPlaces& places, double alpha, WorkerThreads& threads, bool forgets,
                 ModelledPoints& made);

}  // namespace maq
