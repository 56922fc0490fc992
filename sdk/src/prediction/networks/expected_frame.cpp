#include "prediction/networks/expected_frame.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/math/finite.h"

namespace maq {
ExpectedFrame::ExpectedFrame(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                             const SessionSettings& settings)
    : codes_(bundle.codes), times_(2) {
  const Manifest& manifest = bundle.bundle.manifest;
  const ManifestNode node = manifest.root.at("expected");
  manifest.require_graphs({"expected"});
  before_ = size_t(node.at("before").integer(1, int(kMaxContextFrames) - 1));
  frames_ = size_t(node.at("frames").integer(int(before_), int(before_) + 1));
  trained_ = ForecastTimes::read(node);

  const GraphSpec& graph = manifest.graphs.at("expected");
  const Shape given{1, int64_t(frames_ * codes_->slices), int64_t(codes_->places())}, times{1, 2};
  require_tensors(manifest, "expected", "inputs", graph.inputs, {{"before", given}, {"times", times}});
  require_tensors(manifest, "expected", "outputs", graph.outputs, {{"features", bundle.features_shape()}});
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
  trained_.tell(step_s, ahead_s, times_.data());
  const float* const found = session_->run(inputs_, outputs_)[0].data;
  const size_t values = codes_->count() * codes_->width;
  if (!are_finite(found, values)) {
    throw Error(MAQ_ERROR_INFERENCE,
                "The network of expected frames gave numbers that are not finite. Install the bundle again.");
  }
  std::copy_n(found, values, features);
}

}  // namespace maq
