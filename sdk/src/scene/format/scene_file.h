// Scenes on disk: .maqs, mapped into memory when it is opened (docs/formats.md).
#pragma once

#include <string>

#include "scene/build/modelling_state.h"
#include "scene/format/scene.h"

namespace maq {

// Takes the place of a file that is there, when it is complete and on the disk: a process that dies, or a disk that is full,
// leaves the old one. `state` may be null. Throws MAQ_ERROR_UNWRITABLE, and MAQ_ERROR_INVALID_ARGUMENT for a scene without
// points.
void write_scene_file(const Scene& scene, const std::string& path, const ModellingStateView* state = nullptr);

enum class SceneStorage {
  // Pages are read when they are needed and given back when memory is short. Another program that cuts the file in place
  // ends this one with SIGBUS (write_scene_file does not: it makes a new file).
  kMapped,
  kMemory,  // the file may change afterwards
};

// Everything is read once and compared with its checks, but for the state of modelling. What then comes of a scene is within
// its arrays, finite and at most 2e30, even from a file that was made to do harm; a mapped file that somebody writes to later
// can only change numbers.
// Throws MAQ_ERROR_NOT_FOUND; MAQ_ERROR_UNREADABLE for what is no scene, cut off or damaged; MAQ_ERROR_UNSUPPORTED for other
// versions and more than kMostPoints; MAQ_ERROR_OUT_OF_MEMORY.
Scene open_scene_file(const std::string& path, SceneStorage storage = SceneStorage::kMapped);

// Likewise; MAQ_ERROR_UNSUPPORTED for a file that holds none.
ModellingState read_modelling_state(const std::string& path);

}  // namespace maq
