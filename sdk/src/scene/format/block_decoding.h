// The points of a scene as plain numbers, for those who are in no hurry; the renderer decodes what it needs itself.
#pragma once

#include "scene/format/fitted_points.h"
#include "scene/format/scene.h"

namespace maq {

// Those of one block, in its order; slopes are 0 for those that have none. What a scene does not keep is left empty:
// variations and views.
ModelledPoints unpack_block(const Scene& scene, const SceneBlock& block);

}  // namespace maq
