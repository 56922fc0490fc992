#include "prediction/latent/expected_frame.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/math/finite.h"

namespace maq {
namespace {

bool is_tensor(const std::vector<TensorSpec>& side, size_t at, const char* name, const Shape& shape) {
  return at < side.size() && side[at].name == name &&
         side[at].shape == std::vector<Dimension>(shape.begin(), shape.end());
}

}  // namespace

ExpectedFrame::ExpectedFrame(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                             const SessionSettings& settings)
    : codes_(bundle.codes), times_(2) {
  const Manifest& manifest = bundle.bundle.manifest;
  const ManifestNode node = manifest.root.at("expected");
  manifest.require_graphs({"expected"});
  before_ = size_t(node.at("before").integer(1, int(kMaxContextFrames) - 1));
  frames_ = size_t(node.at("frames").integer(int(before_), int(before_) + 1));
  max_ahead_ = float(node.at("max_ahead").integer(1, 1000));
  const auto fps = node.at("fps").numbers<2>(0.1, 1000);
  min_fps_ = fps[0], max_fps_ = fps[1];
  if (max_fps_ < min_fps_) node.at("fps").fail("ends before it begins");

  const GraphSpec& graph = manifest.graphs.at("expected");
  const Shape given{1, int64_t(frames_ * codes_->slices), int64_t(codes_->places())}, times{1, 2};
  if (graph.inputs.size() != 2 || !is_tensor(graph.inputs, 0, "before", given) ||
      !is_tensor(graph.inputs, 1, "times", times) || graph.outputs.size() != 1 ||
      !is_tensor(graph.outputs, 0, "features", bundle.features_shape())) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph expected must have the inputs before [1, ",
                given[1], ", ", given[2], "] and times [1, 2], and the output features as the decoder has it. ",
                "Export the bundle again.");
  }
  session_ = std::make_unique<Session>(std::move(runtime), bundle.bundle.files.at(graph.file), graph,
                                       bundle.bundle.path_of(graph.file), settings);
  given_.resize(frames_ * codes_->count());
  inputs_ = {{given_.data(), given}, {times_.data(), times}};
  outputs_ = {bundle.features_shape()};
}

void ExpectedFrame::run(const ContextFrames& frames, float step_s, float ahead_s, float* features) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const size_t places = codes_->places(), slices = codes_->slices;
  for (size_t frame = 0; frame < frames_; ++frame) {
    for (size_t i = 0; i < codes_->count(); ++i) {
      const size_t at = (frame * slices + i % slices) * places + i / slices;
      given_[at] = frames[frame] == nullptr ? -1.0f : float(frames[frame][i]);
    }
  }
  const float step = std::clamp(step_s, 1 / max_fps_, 1 / min_fps_);
  times_[0] = std::log2(10 * step);
  times_[1] = std::log2(10 * std::clamp(ahead_s, 1 / max_fps_, max_ahead_ * step));
  const float* const found = session_->run(inputs_, outputs_)[0].data;
  const size_t values = codes_->count() * codes_->width;
  if (!are_finite(found, values)) {
    throw Error(MAQ_ERROR_INFERENCE,
                "The network of expected frames gave numbers that are not finite. Install the bundle again.");
  }
  std::copy_n(found, values, features);
}

}  // namespace maq
