#include "densepose/detector/trunk.h"

#include <algorithm>
#include <utility>

#include "core/rounding.h"
#include "nn/thread_choice.h"

namespace maq {
namespace {

constexpr char kPersonLogits[] = "person";  // output of the trunk
constexpr size_t kSizedTrunks = 3;          // kept: of frames at two sizes, and of crops

GraphSpec trunk_graph(const Manifest& manifest, const DensePoseSpec& spec) {
  std::vector<std::string> maps = at_levels("p", Trunk::kFirstLevel, Trunk::kFirstLevel + int(Trunk::kAllLevels) - 1);
  if (spec.box_head.person_logits_stride > 0) maps.push_back(kPersonLogits);
  return graph_with(manifest, "trunk", {"image"}, maps);
}

// Shapes of the outputs for an input of that size.
void set_output_shapes(const DensePoseSpec& spec, int channels, int width_px, int height_px, size_t levels,
                       std::vector<Shape>& shapes) {
  shapes.clear();
  for (size_t l = 0; l < levels; ++l) {
    const int stride = spec.rpn.strides[l];
    shapes.push_back({1, divide_up(height_px, stride), divide_up(width_px, stride), channels});
  }
  const int stride = spec.box_head.person_logits_stride;
  if (levels == Trunk::kAllLevels && stride > 0) {
    shapes.push_back({1, divide_up(height_px, stride), divide_up(width_px, stride), 1});
  }
}

}  // namespace

Trunk::Trunk(const DensePoseNetworks& networks, const DensePoseSpec& spec) : spec_(spec), levels_(kAllLevels) {
  const GraphSpec graph = trunk_graph(networks.bundle().manifest, spec);
  channels_ = feature_channels(graph, networks.bundle().manifest.name);
  std::vector<std::vector<int64_t>> outputs(kAllLevels, {1, kAnySize, kAnySize, channels_});
  outputs.push_back({1, kAnySize, kAnySize, 1});  // the person logits
  session_ = networks.open("trunk", graph, {1, 3, kAnySize, kAnySize}, outputs, networks.on_cpu());
  open_sized(networks, graph);
}

Trunk::Trunk(const DensePoseNetworks& networks, const DensePoseSpec& spec, int channels)
    : spec_(spec), levels_(1), channels_(channels) {
  const GraphSpec graph = graph_with(networks.bundle().manifest, "crop_trunk", {"image"}, {"p2"});
  session_ = networks.open("crop_trunk", graph, {1, 3, kAnySize, kAnySize}, {{1, kAnySize, kAnySize, channels_}},
                           networks.on_cpu());
  open_sized(networks, graph);
}

void Trunk::open_sized(const DensePoseNetworks& networks, const GraphSpec& graph) {
  if (networks.on_provider().provider == MAQ_PROVIDER_CPU) return;
  bytes_ = networks.bundle().files.at(graph.file);
  sized_.emplace(networks.runtime(), bytes_, graph, networks.bundle().path_of(graph.file), networks.on_provider(),
                 kSizedTrunks);
}

int Trunk::measured_threads(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const Bundle& bundle,
                            const DensePoseSpec& spec, int long_side_px, SessionSettings settings) {
  const GraphSpec graph = trunk_graph(bundle.manifest, spec);
  const int width = round_up(long_side_px, spec.input.multiple_of);
  const int height = round_up(3 * long_side_px / 4, spec.input.multiple_of);
  std::vector<Shape> shapes;
  set_output_shapes(spec, feature_channels(graph, bundle.manifest.name), width, height, kAllLevels, shapes);
  return measure_threads(
      runtime,
      {bundle.files.at(graph.file), graph, bundle.path_of(graph.file), width, height, {1, 3, height, width}, shapes},
      std::move(settings));
}

maq_provider Trunk::run(const std::vector<float>& values, int width_px, int height_px, RunCancel& cancel) {
  set_output_shapes(spec_, channels_, width_px, height_px, levels_, shapes_);
  inputs_.assign(1, {values.data(), {1, 3, height_px, width_px}});
  Session& session = sized_ ? sized_->at(width_px, height_px) : *session_;
  pyramid_ = session.run(inputs_, shapes_, &cancel);
  features_.clear();
  for (size_t l = 0; l < std::min(levels_, kFeatureLevels); ++l) {
    const TensorView& map = pyramid_[l];
    features_.push_back({map.data, channels_, int(map.shape[1]), int(map.shape[2]), spec_.box_head.strides[l]});
  }
  person_logits_ = {};
  if (pyramid_.size() > kAllLevels) {
    const TensorView& map = pyramid_[kAllLevels];
    person_logits_ = {map.data, 1, int(map.shape[1]), int(map.shape[2]), spec_.box_head.person_logits_stride};
  }
  return session.provider();
}

}  // namespace maq
