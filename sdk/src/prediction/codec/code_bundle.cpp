#include "prediction/codec/code_bundle.h"

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

}  // namespace

void require_tensors(const Manifest& manifest, const char* graph, const char* what, const std::vector<TensorSpec>& side,
                     const std::vector<NamedShape>& wanted) {
  const auto is_same = [](const TensorSpec& found, const NamedShape& tensor) {
    return found.name == tensor.name && found.shape == std::vector<Dimension>(tensor.shape.begin(), tensor.shape.end());
  };
  if (std::equal(side.begin(), side.end(), wanted.begin(), wanted.end(), is_same)) return;
  std::string text;
  for (const NamedShape& tensor : wanted) {
    text += concatenate(text.empty() ? "" : ", ", tensor.name, " [");
    for (const int64_t& size : tensor.shape) text += concatenate(&size == tensor.shape.begin() ? "" : ", ", size);
    text += "]";
  }
  throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph ", graph, " must have the ", what, " ", text,
              ", as frame_px and the codes have it. Export the bundle again.");
}

CodeBundle::CodeBundle(Bundle opened)
    : bundle(checked_prediction(std::move(opened))),
      codes(codes_of(bundle)),
      frame_px(bundle.manifest.root.at("frame_px").integer(1, kMaxFrame_px)) {
  const Manifest& manifest = bundle.manifest;
  const GraphSpec &encoder = manifest.graphs.at("encoder"), &decoder = manifest.graphs.at("decoder");
  require_tensors(manifest, "encoder", "inputs", encoder.inputs, {{"image", frame_shape()}});
  require_tensors(manifest, "encoder", "outputs", encoder.outputs, {{"features", features_shape()}});
  require_tensors(manifest, "decoder", "inputs", decoder.inputs, {{"features", features_shape()}});
  require_tensors(manifest, "decoder", "outputs", decoder.outputs, {{"image", frame_shape()}});
}

}  // namespace maq
