#include "head/files/prior_file.h"

#include <algorithm>
#include <iterator>

#include "core/files/file.h"
#include "head/files/file_format.h"
#include "head/files/stored_numbers.h"

namespace maq::head {
namespace {

constexpr char kPriorKind[] = "a prior of heads (.maqp)";
constexpr char kPriorRemedy[] = "Export the bundle again, or use the Maquette that it was made for.";

Vec3 vector_of(const float (&values)[3]) { return {values[0], values[1], values[2]}; }

// Throws unless the head's counts fit the size of the file.
void check_counts(const PriorFileHead& head, const FieldShape& shape, const StoredBytes& file) {
  if (head.constant_format > StoredFormat::kFloat16 || head.bases_format > StoredFormat::kInt8 ||
      head.zero[0] + head.zero[1] > 0 ||
      std::any_of(std::begin(head.more_zeros), std::end(head.more_zeros), [](uint8_t byte) { return byte != 0; })) {
    file.fail(" stores its numbers in a way that version ", kPriorFileVersion, " does not have.");
  }
  if (head.shape_codes > uint32_t(kMaxFieldCodes) || head.colour_codes > uint32_t(kMaxFieldCodes) ||
      head.anchors > kMaxHeadAnchors || head.landmarks > kMaxNamedPoints) {
    file.fail(" claims ", head.shape_codes, " and ", head.colour_codes, " codes, ", head.anchors, " anchors and ",
              head.landmarks, " landmarks: more than a prior may have.");
  }
  constexpr uint64_t kMinLandmarkBytes = 1 + 1 + 3 * sizeof(float);
  uint64_t bytes = head.landmarks * kMinLandmarkBytes;
  bytes += head.anchors * (7 * sizeof(float) + 3 * sizeof(uint16_t) * uint64_t(head.shape_codes));
  for (int layer = 0; layer < shape.layers(); ++layer) {
    bytes += stored_layer_bytes(shape, layer, head.constant_format, 1);
    const uint32_t codes = layer < shape.first_surface_layer() ? head.shape_codes : head.colour_codes;
    if (shape.is_personal(layer)) bytes += stored_layer_bytes(shape, layer, head.bases_format, int(codes));
  }
  if (bytes > file.left()) {
    file.fail(" has ", file.left(), " bytes behind its head, but what it claims takes ", bytes, " or more.");
  }
}

}  // namespace

HeadPrior read_prior(const void* bytes, size_t count, const std::string& name) {
  if (count > kMaxPriorFileBytes) {
    throw Error(MAQ_ERROR_UNSUPPORTED, name, " has ", count, " bytes; a prior of heads has at most ",
                kMaxPriorFileBytes, ".");
  }
  StoredBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head = file.head<PriorFileHead>(kPriorFileMagic, kPriorFileVersion, kPriorKind, kPriorRemedy);
  const FieldShape shape = checked_shape(head.shape, file);
  check_counts(head, shape, file);

  HeadPrior prior(WeightBases(shape, int(head.shape_codes), int(head.colour_codes)));
  for (int layer = 0; layer < shape.layers(); ++layer) {
    file.layers(head.constant_format, {prior.bases.constant().layer(layer)});
  }
  for (int layer = 0; layer < shape.layers(); ++layer) {
    if (!shape.is_personal(layer)) continue;
    const int codes = layer < shape.first_surface_layer() ? prior.shape_codes() : prior.colour_codes();
    std::vector<FieldLayer> of_codes;
    for (int code = 0; code < codes; ++code) of_codes.push_back(prior.bases.basis_layer(layer, code));
    file.layers(head.bases_format, of_codes);
  }
  prior.sharpness = head.sharpness;
  prior.cut = {vector_of(head.cut_point), vector_of(head.cut_normal)};
  std::copy_n(head.bounds_min, 3, prior.bounds.min.begin());
  std::copy_n(head.bounds_max, 3, prior.bounds.max.begin());
  const size_t anchors = head.anchors;
  prior.anchors.template_points = file.floats(StoredFormat::kFloat32, 3 * anchors);
  prior.anchors.mean = file.floats(StoredFormat::kFloat32, 3 * anchors);
  prior.anchors.linear = file.floats(StoredFormat::kFloat16, 3 * anchors * head.shape_codes);
  prior.anchors.sigma = file.floats(StoredFormat::kFloat32, anchors);
  prior.landmarks = file.landmarks(head.landmarks);
  file.end();
  check_head_prior(prior);
  return prior;
}

HeadPrior read_prior_file(const std::string& path) {
  const std::vector<uint8_t> bytes = read_file(path, kMaxPriorFileBytes);
  return read_prior(bytes.data(), bytes.size(), path);
}

}  // namespace maq::head
