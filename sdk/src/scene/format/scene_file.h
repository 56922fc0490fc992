// Scenes on disk: .maqs, mapped into memory when it is opened (docs/reference/formats.md).
#pragma once

#include <string>

#include "scene/format/scene.h"

namespace maq {

// Replaces a file of that name atomically, once the new one is complete and on the disk: a process that dies, or a full
// disk, leaves the old one. Throws MAQ_ERROR_UNWRITABLE, and MAQ_ERROR_INVALID_ARGUMENT for a scene without points.
void write_scene_file(const Scene& scene, const std::string& path);

// Maps the file: pages are read when they are needed and given back when memory is short. Another program that
// truncates the file in place ends this one with SIGBUS (write_scene_file does not: it makes a new file).
//
// Everything is read once and compared with its checksums. Whatever the bytes, also those of a hostile file with right
// checksums, what then comes of a scene is within its arrays, finite and at most 2e30; a mapped file that is written to
// later can only change numbers. Throws MAQ_ERROR_NOT_FOUND; MAQ_ERROR_UNREADABLE for a file that is not a scene,
// truncated or damaged; MAQ_ERROR_UNSUPPORTED for other versions and more than kMaxPoints; MAQ_ERROR_OUT_OF_MEMORY.
Scene open_scene_file(const std::string& path);

// The same of a file's bytes in memory, at any alignment, with the same checks. All is copied: the bytes may be freed
// or changed afterwards. `bytes` may be null where `count` is 0.
Scene open_scene_memory(const void* bytes, size_t count);

}  // namespace maq
