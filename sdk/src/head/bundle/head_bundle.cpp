#include "head/bundle/head_bundle.h"

#include <string>

#include "core/error.h"
#include "head/files/prior_file.h"

namespace maq::head {
namespace {

constexpr char kGraph[] = "encoder";
constexpr int kMaxCrop_px = 1024, kMaxCell_px = 64;

Bundle checked_task(Bundle bundle) {
  bundle.manifest.require_task("heads");
  bundle.manifest.require_graphs({kGraph});
  return bundle;
}

void require_tensor(const Manifest& manifest, const std::vector<TensorSpec>& side, const char* what, const char* name,
                    int64_t side_px, int64_t channels) {
  const std::vector<Dimension> wanted = {int64_t(1), side_px, side_px, channels};
  if (side.size() == 1 && side[0].name == name && side[0].shape == wanted) return;
  throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph ", kGraph, " must have one ", what, ", ", name,
              " [1, ", side_px, ", ", side_px, ", ", channels, "]. Export the bundle again.");
}

EncoderSpec checked_encoder(const Manifest& manifest) {
  const ManifestNode node = manifest.root.at("encoder");
  const int crop_px = node.at("crop_px").integer(1, kMaxCrop_px);
  EncoderSpec encoder;
  encoder.cells.cell_px = node.at("cell_px").integer(1, kMaxCell_px);
  if (crop_px % encoder.cells.cell_px != 0) node.at("crop_px").fail("is ", crop_px, ", not a multiple of cell_px");
  encoder.cells.side = crop_px / encoder.cells.cell_px;
  encoder.crop_sides = double(node.at("crop_sides").number(1, 8));
  const GraphSpec& graph = manifest.graphs.at(kGraph);
  require_tensor(manifest, graph.inputs, "input", "image", crop_px, 3);
  require_tensor(manifest, graph.outputs, "output", "cells", encoder.cells.side, int64_t(kCellChannels));
  return encoder;
}

std::string prior_name(const Manifest& manifest) { return manifest.listed_file(manifest.root.at("prior").at("file")); }

HeadPrior prior_of(const Bundle& bundle) {
  const std::string name = prior_name(bundle.manifest);
  const std::vector<uint8_t>& bytes = bundle.files.at(name);
  return read_prior(bytes.data(), bytes.size(), bundle.path_of(name));
}

// Of the digest's text, which read_bundle() compared with the file.
std::array<uint8_t, 32> digest_of(const std::string& hexadecimal) {
  std::array<uint8_t, 32> digest{};
  for (size_t i = 0; i < digest.size(); ++i) digest[i] = uint8_t(std::stoi(hexadecimal.substr(2 * i, 2), nullptr, 16));
  return digest;
}

}  // namespace

HeadBundle::HeadBundle(Bundle opened)
    : bundle(checked_task(std::move(opened))),
      encoder(checked_encoder(bundle.manifest)),
      prior(prior_of(bundle)),
      prior_sha256(digest_of(bundle.manifest.files.at(prior_name(bundle.manifest)).sha256)) {
  bundle.files.erase(prior_name(bundle.manifest));
}

const GraphSpec& HeadBundle::encoder_graph() const { return bundle.manifest.graphs.at(kGraph); }

}  // namespace maq::head
