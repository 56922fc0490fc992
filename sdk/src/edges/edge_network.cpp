#include "edges/edge_network.h"

#include <algorithm>

#include "core/error.h"
#include "core/rounding.h"
#include "edges/depth_slopes.h"
#include "edges/field_decode.h"
#include "nn/thread_choice.h"

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

int checked_multiple_px(const Manifest& manifest) {
  const auto& node = manifest.root.at("field").at("multiple_px");
  const int multiple_px = node.integer(kFold, 256);
  if (multiple_px % kFold != 0) node.fail("is ", multiple_px, ", but must be even");
  return multiple_px;
}

bool is_output_over_input(const Manifest& manifest) {
  const auto found = manifest.root.at("field").find("output_over_input");
  return found && found->integer(0, 1) == 1;
}

Shape input_shape(int width_px, int height_px) {
  return {1, height_px / kFold, width_px / kFold, DepthSlopes::kChannels};
}

Shape output_shape(int width_px, int height_px) {
  return {1, height_px / kFold, width_px / kFold, FieldDecode::kChannels};
}

int threads_of(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const Bundle& bundle, int multiple_px,
               const SessionSettings& settings) {
  if (settings.threads != MAQ_THREADS_MEASURED) return settings.threads;
  // Between what phones and what depth cameras give.
  const int width = round_up(320, multiple_px), height = round_up(240, multiple_px);
  const GraphSpec& graph = bundle.manifest.graphs.at(kGraph);
  return measure_threads(runtime,
                         {bundle.files.at(graph.file),
                          graph,
                          bundle.path_of(graph.file),
                          width / kFold,
                          height / kFold,
                          input_shape(width, height),
                          {output_shape(width, height)}},
                         settings);
}

// Planned memory is a second block in addition to the first run's memory. Without it a stream takes an eighth less
// memory, in the same time.
SessionSettings of_stream(SessionSettings settings, int threads) {
  settings.threads = threads;
  settings.plans_memory = false;
  return settings;
}

}  // namespace

EdgeNetwork::EdgeNetwork(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle,
                         const SessionSettings& settings)
    : bundle_(checked_edges(std::move(bundle))),
      eps_r_(bundle_.manifest.root.at("field").at("eps_r").number(1, kMaxEps_r)),
      multiple_px_(checked_multiple_px(bundle_.manifest)),
      threads_(threads_of(runtime, bundle_, multiple_px_, settings)),
      is_shared_(is_output_over_input(bundle_.manifest)),
      sessions_(std::move(runtime), bundle_.files.at(bundle_.manifest.graphs.at(kGraph).file),
                bundle_.manifest.graphs.at(kGraph), bundle_.path_of(bundle_.manifest.graphs.at(kGraph).file),
                of_stream(settings, threads_), kSessionsKept) {}

float* EdgeNetwork::input(int width_px, int height_px) {
  const size_t cells = size_t(width_px / kFold) * size_t(height_px / kFold);
  const size_t channels =
      is_shared_ ? std::max(DepthSlopes::kChannels, FieldDecode::kChannels) : DepthSlopes::kChannels;
  if (values_.size() < cells * channels) values_.resize(cells * channels);
  return values_.data();
}

const float* EdgeNetwork::run(int width_px, int height_px, const RunCancel& cancel) {
  inputs_.assign(1, {values_.data(), input_shape(width_px, height_px)});
  shapes_.assign(1, output_shape(width_px, height_px));
  Session& session = sessions_.at(width_px / kFold, height_px / kFold);
  provider_ = session.provider();
  // Other providers may hand both to a device at once.
  float* const output = is_shared_ && provider_ == MAQ_PROVIDER_CPU ? values_.data() : nullptr;
  return session.run(inputs_, shapes_, &cancel, output)[0].data;
}

}  // namespace maq
