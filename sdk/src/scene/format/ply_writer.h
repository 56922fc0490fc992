// A scene as a point cloud that other programs open.
#pragma once

#include <string>

#include "scene/format/scene.h"

namespace maq {

// Binary little-endian PLY: x, y, z in the world (float; double where the origin is over 100 times as far away as the
// scene is large, since floats would then be coarse) and red, green, blue: the first three features of the constant
// term. Replaces a file of that name atomically. Throws MAQ_ERROR_UNWRITABLE; then an older file is as it was.
void write_scene_ply(const Scene& scene, const std::string& path);

}  // namespace maq
