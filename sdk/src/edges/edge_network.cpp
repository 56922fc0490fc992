#include "edges/edge_network.h"

#include "core/error.h"
#include "edges/depth_slopes.h"
#include "edges/field_decode.h"

namespace maq {
namespace {

constexpr char kGraph[] = "field";
constexpr int kFold = DepthSlopes::kFold;
constexpr size_t kSessionsKept = 4;
// A file holds distances as thousandths of a footprint in 16 bits.
constexpr double kMaxEps_r = 65;

void require_tensor(const Manifest& manifest, const std::vector<TensorSpec>& side, const char* what, const char* name,
                    int64_t channels) {
  const auto is_as_wanted = [&](const TensorSpec& tensor) {
    const int64_t* last = tensor.shape.size() == 4 ? std::get_if<int64_t>(&tensor.shape[3]) : nullptr;
    return tensor.name == name && last != nullptr && *last == channels;
  };
  if (side.size() != 1 || !is_as_wanted(side[0])) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph ", kGraph, " must have one ", what, ", ", name,
                " with ", channels, " channels last. Export the bundle again.");
  }
}

Bundle checked_edges(Bundle bundle) {
  const Manifest& manifest = bundle.manifest;
  manifest.require_task("edges");
  manifest.require_graphs({kGraph});
  const GraphSpec& graph = manifest.graphs.at(kGraph);
  require_tensor(manifest, graph.inputs, "input", "slopes", DepthSlopes::kChannels);
  require_tensor(manifest, graph.outputs, "output", "planes", FieldDecode::kChannels);
  return bundle;
}

}  // namespace

EdgeNetwork::EdgeNetwork(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle,
                         const SessionSettings& settings)
    : bundle_(checked_edges(std::move(bundle))),
      eps_r_(bundle_.manifest.root.at("field").at("eps_r").number(1, kMaxEps_r)),
      multiple_px_(bundle_.manifest.root.at("field").at("multiple_px").integer(kFold, 256)),
      sessions_(std::move(runtime), bundle_.files.at(bundle_.manifest.graphs.at(kGraph).file),
                bundle_.manifest.graphs.at(kGraph), bundle_.path_of(bundle_.manifest.graphs.at(kGraph).file), settings,
                kSessionsKept) {
  if (multiple_px_ % kFold != 0) {
    bundle_.manifest.root.at("field").at("multiple_px").fail("is ", multiple_px_, ", but must be even");
  }
}

const float* EdgeNetwork::run(const float* slopes, int width_px, int height_px, const RunCancel& cancel) {
  const int64_t width = width_px / kFold, height = height_px / kFold;
  inputs_.assign(1, {slopes, {1, height, width, DepthSlopes::kChannels}});
  shapes_.assign(1, {1, height, width, FieldDecode::kChannels});
  Session& session = sessions_.at(int(width), int(height));
  provider_ = session.provider();
  return session.run(inputs_, shapes_, &cancel)[0].data;
}

}  // namespace maq
