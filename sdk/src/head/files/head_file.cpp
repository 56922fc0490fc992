#include "head/files/head_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/files/atomic_file.h"
#include "core/files/file.h"
#include "head/files/file_format.h"
#include "head/files/stored_numbers.h"

namespace maq::head {
namespace {

constexpr char kHeadKind[] = "a head (.maqh)";
constexpr char kHeadRemedy[] = "Fit the head again, or use the Maquette that it was made with.";
constexpr StoredFormat kStoredHalf = StoredFormat::kFloat16, kStoredFloat = StoredFormat::kFloat32;
constexpr float kMaxHalf = 65504;
constexpr uint32_t kFirstHeadFileVersion = 1;  // it is read, too

// The version of a file that begins like this version; otherwise the version that is written.
uint32_t version_to_read(const void* bytes, size_t count) {
  FileStart start;
  if (count < sizeof start) return kHeadFileVersion;
  std::memcpy(&start, bytes, sizeof start);
  return start.version == kFirstHeadFileVersion ? kFirstHeadFileVersion : kHeadFileVersion;
}

Vec3 vector_of(const double (&values)[3]) { return {values[0], values[1], values[2]}; }

void put(Vec3 vector, double (&values)[3]) {
  values[0] = vector.x;
  values[1] = vector.y;
  values[2] = vector.z;
}

StoredCamera stored(const HeadCamera& camera) {
  StoredCamera made{camera.width_px, camera.height_px, camera.focal_px, camera.cx_px, camera.cy_px, {}, {}};
  std::copy(camera.head_to_camera.rotation.begin(), camera.head_to_camera.rotation.end(), made.rotation);
  put(camera.head_to_camera.translation, made.translation);
  return made;
}

HeadCamera camera_of(const StoredCamera& stored) {
  HeadCamera camera;
  camera.width_px = stored.width_px;
  camera.height_px = stored.height_px;
  camera.focal_px = stored.focal_px;
  camera.cx_px = stored.cx_px;
  camera.cy_px = stored.cy_px;
  std::copy_n(stored.rotation, 9, camera.head_to_camera.rotation.begin());
  camera.head_to_camera.translation = vector_of(stored.translation);
  return camera;
}

// Throws unless the head's counts fit the size of the file.
void check_counts(const HeadFileHead& head, const FieldShape& shape, const StoredBytes& file) {
  if (head.shape_codes > uint32_t(kMaxFieldCodes) || head.colour_codes > uint32_t(kMaxFieldCodes) ||
      head.cameras > kMaxStoredCameras || head.anchors > kMaxHeadAnchors || head.landmarks > kMaxNamedPoints) {
    file.fail(" claims ", head.shape_codes, " and ", head.colour_codes, " codes, ", head.cameras, " cameras, ",
              head.anchors, " anchors and ", head.landmarks, " landmarks: more than a head may have.");
  }
  const uint32_t version = head.start.version;
  if (head.zero > 0 || head.has_texture > 1 || head.has_code_factor > version - kFirstHeadFileVersion) {
    file.fail(" stores its numbers in a way that version ", version, " does not have.");
  }
  uint64_t weights = 0;
  for (int layer = 0; layer < shape.layers(); ++layer) weights += stored_layer_bytes(shape, layer, kStoredHalf, 1);
  if (weights > file.left()) {
    file.fail(" has ", file.left(), " bytes behind its head, but the weights that it claims take ", weights, ".");
  }
}

}  // namespace

std::vector<uint8_t> head_file_bytes(const StoredHead& head) {
  if (const std::string fault = stored_head_fault(head); !fault.empty()) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The head cannot be stored: ", fault, ". Fit it again.");
  }
  const AlignedFloats& weights = head.weights.values();
  if (!std::all_of(weights.begin(), weights.end(), [](float value) { return std::abs(value) <= kMaxHalf; })) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The head cannot be stored: one of its weights is beyond ", kMaxHalf,
                ". Fit it again.");
  }
  HeadFileHead file_head{};
  file_head.shape = stored_shape(head.weights.shape());
  file_head.shape_codes = uint32_t(head.codes.shape.size());
  file_head.colour_codes = uint32_t(head.codes.colour.size());
  file_head.cameras = uint32_t(head.cameras.size());
  file_head.anchors = uint32_t(head.anchors.count());
  file_head.landmarks = uint32_t(head.landmarks.size());
  file_head.sharpness = head.sharpness;
  file_head.scale_source = uint8_t(head.scale.source);
  file_head.has_texture = head.texture.side_px > 0 ? 1 : 0;
  file_head.has_code_factor = head.code_factor.empty() ? 0 : 1;
  file_head.metres_per_unit = head.scale.metres_per_unit;
  file_head.metres_sigma = head.scale.sigma;
  put(head.cut.point, file_head.cut_point);
  put(head.cut.normal, file_head.cut_normal);
  std::copy(head.bounds.min.begin(), head.bounds.min.end(), file_head.bounds_min);
  std::copy(head.bounds.max.begin(), head.bounds.max.end(), file_head.bounds_max);
  std::copy(head.prior_sha256.begin(), head.prior_sha256.end(), file_head.prior_sha256);

  BytesWriter writer;
  writer.number(file_head);
  for (int layer = 0; layer < head.weights.shape().layers(); ++layer)
    writer.layer(kStoredHalf, head.weights.layer(layer));
  for (const auto* codes : {&head.codes.shape, &head.codes.colour})
    writer.floats(kStoredFloat, codes->data(), codes->size());
  writer.floats(kStoredHalf, head.code_factor.data(), head.code_factor.size());
  for (const HeadCamera& camera : head.cameras) writer.number(stored(camera));
  for (const auto* values : {&head.anchors.template_points, &head.anchors.points, &head.anchors.sigma}) {
    writer.floats(kStoredHalf, values->data(), values->size());
  }
  for (const NamedPoint& landmark : head.landmarks) {
    writer.number(uint8_t(landmark.name.size()));
    writer.text(landmark.name);
    writer.floats(kStoredFloat, landmark.template_point.data(), 3);
  }
  if (file_head.has_texture != 0) {
    writer.number(uint32_t(head.texture.side_px));
    writer.number(uint32_t(head.texture.jpeg.size()));
    writer.bytes(head.texture.jpeg);
  }
  writer.finish(sizeof file_head, kHeadFileMagic, kHeadFileVersion);
  return writer.bytes();
}

void write_head_file(const StoredHead& head, const std::string& path) {
  const std::vector<uint8_t> bytes = head_file_bytes(head);
  AtomicFile file(path);
  file.append(bytes.data(), bytes.size());
  file.commit();
}

StoredHead read_head(const void* bytes, size_t count, const std::string& name) {
  if (count > kMaxHeadFileBytes) {
    throw Error(MAQ_ERROR_UNSUPPORTED, name, " has ", count, " bytes; a head has at most ", kMaxHeadFileBytes, ".");
  }
  StoredBytes file(bytes, count, name, MAQ_ERROR_UNREADABLE);
  const auto file_head = file.head<HeadFileHead>(kHeadFileMagic, version_to_read(bytes, count), kHeadKind, kHeadRemedy);
  const FieldShape shape = checked_shape(file_head.shape, file);
  check_counts(file_head, shape, file);

  StoredHead head{FieldWeights(shape)};
  for (int layer = 0; layer < shape.layers(); ++layer) file.layers(kStoredHalf, {head.weights.layer(layer)});
  head.codes.shape = file.floats(kStoredFloat, file_head.shape_codes);
  head.codes.colour = file.floats(kStoredFloat, file_head.colour_codes);
  if (file_head.has_code_factor != 0) {
    const size_t codes = file_head.shape_codes;
    head.code_factor = file.floats(kStoredHalf, codes * (codes + 1) / 2);
  }
  for (uint32_t i = 0; i < file_head.cameras; ++i) head.cameras.push_back(camera_of(file.number<StoredCamera>()));
  head.anchors.template_points = file.floats(kStoredHalf, 3 * size_t(file_head.anchors));
  head.anchors.points = file.floats(kStoredHalf, 3 * size_t(file_head.anchors));
  head.anchors.sigma = file.floats(kStoredHalf, file_head.anchors);
  head.landmarks = file.landmarks(file_head.landmarks);
  if (file_head.has_texture != 0) {
    const auto side_px = file.number<uint32_t>(), bytes_of_texture = file.number<uint32_t>();
    if (side_px < 1 || side_px > uint32_t(kMaxTextureSide_px) || bytes_of_texture < 1) {
      file.fail(" has a texture of ", side_px, " pixels a side and ", bytes_of_texture, " bytes, which none has.");
    }
    head.texture = {int(side_px), file.bytes(bytes_of_texture)};
  }
  file.end();
  head.scale = {file_head.metres_per_unit, file_head.metres_sigma, ScaleSource(file_head.scale_source)};
  head.sharpness = file_head.sharpness;
  head.cut = {vector_of(file_head.cut_point), vector_of(file_head.cut_normal)};
  std::copy_n(file_head.bounds_min, 3, head.bounds.min.begin());
  std::copy_n(file_head.bounds_max, 3, head.bounds.max.begin());
  std::copy_n(file_head.prior_sha256, 32, head.prior_sha256.begin());
  if (const std::string fault = stored_head_fault(head); !fault.empty()) {
    file.fail(" cannot be used: ", fault, ". Fit the head again.");
  }
  return head;
}

StoredHead read_head_file(const std::string& path) {
  const std::vector<uint8_t> bytes = read_file(path, kMaxHeadFileBytes);
  return read_head(bytes.data(), bytes.size(), path);
}

}  // namespace maq::head
