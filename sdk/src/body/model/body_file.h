// The body of a bundle as a file (.maqb, docs/reference/formats.md). export/body/body_file.py writes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "body/model/body_model.h"
#include "core/files/checked_bytes.h"
#include "nn/bundle.h"

namespace maq::body {

inline constexpr uint32_t kBodyFileVersion = 1;
inline constexpr char kBodyFileMagic[8] = {'M', 'A', 'Q', 'B', 'O', 'D', '\r', '\n'};
inline constexpr uint64_t kMaxBodyFileBytes = uint64_t(4) << 20;

// shapes: float32 step of the basis [shapes].
// joints: of each u8 length of its name, the name, i8 parent; then i16 rest [joints][3], i16 basis [shapes][joints][3].
// points (vertices, then keypoints): i16 rest [points][3], i16 basis [shapes][points][3], u8 joints [points][4],
// u8 weights [points][4] (sum 255).
// triangles: u16 [triangles][3].
// surface: u16 triangle [24][nodes][nodes] (65535: none), u8 fractions of its first two vertices [24][nodes][nodes][2].
// prior, of A = 3 (joints - 1) angles: float32 mean [A], low [A], high [A], precision [A][A].
struct BodyFileHead {
  FileStart start;
  uint32_t joints, shapes, vertices, keypoints, triangles, surface_nodes;
  float point_step_m;
  uint32_t reserved;
};
static_assert(sizeof(BodyFileHead) == 64);

// `bytes` may be null where `count` is 0, and are not needed afterwards. `name` begins the sentence of errors. Hostile
// bytes with a correct checksum are safe too: the result has no fault, and takes at most 30 times the file's memory.
// Throws MAQ_ERROR_BAD_BUNDLE for a file that is not a body, truncated or damaged; MAQ_ERROR_UNSUPPORTED for another
// version, or more than kMaxBodyFileBytes.
BodyModel read_body(const void* bytes, size_t count, const std::string& name);

// Returns the body of a bundle. Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task, MAQ_ERROR_BAD_BUNDLE if the
// manifest names no body, and the errors of read_body().
std::shared_ptr<const BodyModel> model_of_bundle(const Bundle& bundle);

}  // namespace maq::body
