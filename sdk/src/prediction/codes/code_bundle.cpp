#include "prediction/codes/code_bundle.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"

namespace maq {
namespace {

constexpr int kMaxFrame_px = 1024;

Bundle checked_prediction(Bundle bundle) {
  bundle.manifest.require_task("prediction");
  bundle.manifest.require_graphs({"encoder", "decoder"});
  return bundle;
}

std::shared_ptr<const FrameCodes> codes_of(Bundle& bundle) {
  const std::string name = bundle.manifest.listed_file(bundle.manifest.root.at("codes").at("file"));
  const std::vector<uint8_t>& bytes = bundle.files.at(name);
  auto codes = std::make_shared<const FrameCodes>(read_code_file(bytes.data(), bytes.size(), bundle.path_of(name)));
  bundle.files.erase(name);
  return codes;
}

// That a side of a graph is this one tensor.
void require_tensor(const Manifest& manifest, const char* graph, const std::vector<TensorSpec>& side, const char* what,
                    const char* name, const Shape& shape) {
  const std::vector<Dimension> wanted(shape.begin(), shape.end());
  if (side.size() == 1 && side[0].name == name && side[0].shape == wanted) return;
  throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph ", graph, " must have one ", what, ", ", name,
              " [", shape[0], ", ", shape[1], ", ", shape[2], ", ", shape[3],
              "], as frame_px and the codes have it. Export the bundle again.");
}

}  // namespace

CodeBundle::CodeBundle(Bundle opened)
    : bundle(checked_prediction(std::move(opened))),
      codes(codes_of(bundle)),
      frame_px(bundle.manifest.root.at("frame_px").integer(1, kMaxFrame_px)) {
  const Manifest& manifest = bundle.manifest;
  const GraphSpec &encoder = manifest.graphs.at("encoder"), &decoder = manifest.graphs.at("decoder");
  require_tensor(manifest, "encoder", encoder.inputs, "input", "image", frame_shape());
  require_tensor(manifest, "encoder", encoder.outputs, "output", "features", features_shape());
  require_tensor(manifest, "decoder", decoder.inputs, "input", "features", features_shape());
  require_tensor(manifest, "decoder", decoder.outputs, "output", "image", frame_shape());
}

}  // namespace maq
