// The bytes of a prior (.maqp), of a stored head (.maqh) and of the template head (.maqt). Numbers are little-endian,
// as on every machine that the SDK runs on. The parts in the comment of each head follow it without gaps.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/files/checked_bytes.h"

namespace maq::head {

inline constexpr uint32_t kPriorFileVersion = 1, kHeadFileVersion = 2, kTemplateFileVersion = 1;
inline constexpr char kPriorFileMagic[8] = {'M', 'A', 'Q', 'P', 'R', 'I', '\r', '\n'};
inline constexpr char kHeadFileMagic[8] = {'M', 'A', 'Q', 'H', 'E', 'D', '\r', '\n'};
inline constexpr char kTemplateFileMagic[8] = {'M', 'A', 'Q', 'T', 'E', 'M', '\r', '\n'};

// How floats are stored.
enum class StoredFormat : uint8_t {
  kFloat32,
  kFloat16,
  kInt8,  // of bases alone: float32 scale of each row, then the steps of all rows, then float16 biases
};

// FieldShape.
struct StoredShape {
  uint32_t octaves, width, geometry_layers, feature, surface_width, surface_layers;
  uint32_t personal_geometry_layers, personal_surface_layers;
  float smoothing;
};

// constant: each layer's weights [outputs][inputs] and bias [outputs].
// bases: of each personal geometry layer weights [shape codes][outputs][inputs] and bias [shape codes][outputs]; then
// of each personal surface layer the same for colour codes.
// anchors: float32 template points [anchors][3], mean [anchors][3]; float16 linear [anchors][3][shape codes];
// float32 sigma [anchors].
// landmarks: of each u8 length of its name, the name, float32 template point [3].
struct PriorFileHead {
  FileStart start;
  StoredShape shape;
  uint32_t shape_codes, colour_codes, anchors, landmarks;
  StoredFormat constant_format, bases_format;
  uint8_t zero[2];
  float sharpness, cut_point[3], cut_normal[3], bounds_min[3], bounds_max[3];
  uint8_t more_zeros[4];
};
static_assert(sizeof(PriorFileHead) == 144 && offsetof(PriorFileHead, sharpness) == 88);

// weights: of each layer, float16: weights [outputs][inputs] and bias [outputs].
// codes: float32 shape codes, colour codes; where has_code_factor is 1, float16 [K (K + 1) / 2] of K shape codes.
// cameras: StoredCamera.
// anchors: float16 template points [anchors][3], points [anchors][3], sigma [anchors].
// landmarks: as of a prior.
// texture, where has_texture is 1: u32 pixels a side, u32 bytes, a JPEG file.
struct HeadFileHead {
  FileStart start;
  StoredShape shape;
  uint32_t shape_codes, colour_codes, cameras, anchors, landmarks;
  float sharpness;
  uint8_t scale_source, has_texture, has_code_factor, zero;  // has_code_factor: 0 in files of version 1
  double metres_per_unit, metres_sigma, cut_point[3], cut_normal[3];
  float bounds_min[3], bounds_max[3];
  uint8_t prior_sha256[32];
};
static_assert(sizeof(HeadFileHead) == 216 && offsetof(HeadFileHead, metres_per_unit) == 96);

struct StoredCamera {
  int32_t width_px, height_px;
  double focal_px, cx_px, cy_px, rotation[9], translation[3];
};
static_assert(sizeof(StoredCamera) == 128);

// points: int16 [points][3], in steps of point_step_dm. kinds: TemplateKind [points].
// vertices: u16 point of each; u16 [vertices][2]: u and v times 65535.
// triangles: u16 vertices [triangles][3].
// actions: of each u8 length of its name, the name, u16 number of points that move, u16 these, int16 [.][3] in steps of
// move_step_dm.
struct TemplateFileHead {
  FileStart start;
  uint32_t points, vertices, triangles, actions;
  float point_step_dm, move_step_dm;
};
static_assert(sizeof(TemplateFileHead) == 56);

}  // namespace maq::head
