#include "prediction/refine/residual_refiner.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/math/finite.h"

namespace maq {

TimeInputs TimeInputs::read(const ManifestNode& node) {
  TimeInputs times;
  times.max_ahead = float(node.at("max_ahead").integer(1, 1000));
  const auto fps = node.at("fps").numbers<2>(0.1, 1000);
  times.min_fps = fps[0], times.max_fps = fps[1];
  if (times.max_fps < times.min_fps) node.at("fps").fail("ends before it begins");
  return times;
}

void TimeInputs::write(float step_s, float ahead_s, float* two) const {
  const float step = std::clamp(step_s, 1 / max_fps, 1 / min_fps);
  two[0] = std::log2(10 * step);
  two[1] = std::log2(10 * std::clamp(ahead_s, 1 / max_fps, max_ahead * step));
}

ResidualRefiner::ResidualRefiner(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                                 const SessionSettings& settings)
    : times_(2) {
  const Manifest& manifest = bundle.bundle.manifest;
  const ManifestNode node = manifest.root.at("mended");
  manifest.require_graphs({"mended"});
  before_ = size_t(node.at("before").integer(1, int(kMaxBefore)));
  trained_ = TimeInputs::read(node);
  const int64_t side = bundle.frame_px;
  const Shape given{1, side, side, 3 * (int64_t(before_) + 1)}, times{1, 2};
  const GraphSpec& graph = manifest.graphs.at("mended");
  require_tensors(manifest, "mended", "inputs", graph.inputs, {{"pictures", given}, {"times", times}});
  require_tensors(manifest, "mended", "outputs", graph.outputs, {{"picture", bundle.frame_shape()}});
  session_ = open_session(std::move(runtime), bundle.bundle.files.at(graph.file), graph,
                          bundle.bundle.path_of(graph.file), settings);
  values_ = size_t(side) * size_t(side) * 3;
  given_.resize((before_ + 1) * values_);
  inputs_ = {{given_.data(), given}, {times_.data(), times}};
  outputs_ = {bundle.frame_shape()};
}

void ResidualRefiner::run(const uint8_t* const* frames, const uint8_t* predicted, float step_s, float ahead_s,
                          float* refined) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const uint8_t* const oldest =
      *std::find_if(frames, frames + before_ - 1, [](auto frame) { return frame != nullptr; });
  for (size_t i = 0; i <= before_; ++i) {
    const uint8_t* const from = i == before_ ? predicted : frames[i] != nullptr ? frames[i] : oldest;
    for (size_t pixel = 0; pixel < values_ / 3; ++pixel) {
      std::copy_n(from + 3 * pixel, 3, given_.data() + (pixel * (before_ + 1) + i) * 3);
    }
  }
  trained_.write(step_s, ahead_s, times_.data());
  const float* const found = session_->run(inputs_, outputs_)[0].data;
  if (!are_finite(found, values_)) {
    throw Error(MAQ_ERROR_INFERENCE,
                "The refining network returned numbers that are not finite. Install the bundle again.");
  }
  std::copy_n(found, values_, refined);
}

}  // namespace maq
