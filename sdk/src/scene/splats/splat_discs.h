// Splats in place of a scene's points.
#pragma once

#include "core/worker_threads.h"
#include "scene/format/scene.h"
#include "scene/splats/splats.h"

namespace maq {

// A flat, opaque disc for each point, as large as the gaps between its neighbours, in their plane, with the colour that
// the point has on average. Where the neighbours lie in no plane the disc is thicker. The same splats with any number
// of threads.
Splats splats_of_points(const Scene& scene, WorkerThreads& threads);

}  // namespace maq
