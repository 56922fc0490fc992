#include "head/bundle/head_bundle.h"

#include <string>

#include "core/error.h"
#include "head/files/prior_file.h"
#include "head/files/template_file.h"

namespace maq::head {
namespace {

constexpr char kGraph[] = "encoder";
constexpr int kMaxCrop_px = 1024, kMaxCell_px = 64;

Bundle checked_task(Bundle bundle) {
  bundle.manifest.require_task("heads");
  bundle.manifest.require_graphs({kGraph});
  return bundle;
}

bool is_tensor(const TensorSpec& tensor, const char* name, const std::vector<Dimension>& shape) {
  return tensor.name == name && tensor.shape == shape;
}

// The first of `side`, which must have no more than `count`.
void require_tensor(const Manifest& manifest, const std::vector<TensorSpec>& side, size_t count, const char* what,
                    const char* name, int64_t side_px, int64_t channels) {
  if (side.size() == count && is_tensor(side[0], name, {int64_t(1), side_px, side_px, channels})) return;
  throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph ", kGraph, " must have the ", what, " ", name,
              " [1, ", side_px, ", ", side_px, ", ", channels, "]. Export the bundle again.");
}

FaceSpec checked_face(const ManifestNode& node) {
  constexpr float kMaxReach_dm = 4;
  const auto center = node.at("center_dm").numbers<3>(-kMaxReach_dm, kMaxReach_dm);
  FaceSpec face;
  face.center_dm = {double(center[0]), double(center[1]), double(center[2])};
  face.radius_dm = double(node.at("radius_dm").number(0.01f, kMaxReach_dm));
  face.crop_sides = double(node.at("crop_sides").number(1, 8));
  return face;
}

EncoderSpec checked_encoder(const Manifest& manifest) {
  const ManifestNode node = manifest.root.at("encoder");
  const int crop_px = node.at("crop_px").integer(1, kMaxCrop_px);
  EncoderSpec encoder;
  encoder.cells.cell_px = node.at("cell_px").integer(1, kMaxCell_px);
  if (crop_px % encoder.cells.cell_px != 0) node.at("crop_px").fail("is ", crop_px, ", not a multiple of cell_px");
  encoder.cells.side = crop_px / encoder.cells.cell_px;
  encoder.crop_sides = double(node.at("crop_sides").number(1, 8));
  if (const auto face = node.find("face")) encoder.face = checked_face(*face);
  const GraphSpec& graph = manifest.graphs.at(kGraph);
  require_tensor(manifest, graph.inputs, 1, "input", "image", crop_px, 3);
  require_tensor(manifest, graph.outputs, 1, "output", "cells", encoder.cells.side, int64_t(kCellChannels));
  return encoder;
}

std::string prior_name(const Manifest& manifest) { return manifest.listed_file(manifest.root.at("prior").at("file")); }

std::string template_name(const Manifest& manifest) {
  return manifest.listed_file(manifest.root.at("template").at("file"));
}

HeadPrior prior_of(const Bundle& bundle) {
  const std::string name = prior_name(bundle.manifest);
  const std::vector<uint8_t>& bytes = bundle.files.at(name);
  return read_prior(bytes.data(), bytes.size(), bundle.path_of(name));
}

// Converts the digest's text, which read_bundle() compared with the file.
std::array<uint8_t, 32> digest_of(const std::string& hexadecimal) {
  std::array<uint8_t, 32> digest{};
  for (size_t i = 0; i < digest.size(); ++i) digest[i] = uint8_t(std::stoi(hexadecimal.substr(2 * i, 2), nullptr, 16));
  return digest;
}

}  // namespace

std::shared_ptr<const HeadTemplate> template_of_bundle(const Bundle& bundle) {
  bundle.manifest.require_task("heads");
  if (!bundle.manifest.root.find("template")) return nullptr;
  const std::string name = template_name(bundle.manifest);
  const std::vector<uint8_t>& bytes = bundle.files.at(name);
  return std::make_shared<const HeadTemplate>(read_template(bytes.data(), bytes.size(), bundle.path_of(name)));
}

HeadBundle::HeadBundle(Bundle opened)
    : bundle(checked_task(std::move(opened))),
      encoder(checked_encoder(bundle.manifest)),
      prior(prior_of(bundle)),
      prior_sha256(digest_of(bundle.manifest.files.at(prior_name(bundle.manifest)).sha256)),
      template_head(template_of_bundle(bundle)) {
  bundle.files.erase(prior_name(bundle.manifest));
  if (template_head != nullptr) bundle.files.erase(template_name(bundle.manifest));
}

const GraphSpec& HeadBundle::encoder_graph() const { return bundle.manifest.graphs.at(kGraph); }

}  // namespace maq::head
