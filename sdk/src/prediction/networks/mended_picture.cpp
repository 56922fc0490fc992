#include "prediction/networks/mended_picture.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/math/finite.h"

namespace maq {

MendedPicture::MendedPicture(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                             const SessionSettings& settings)
    : times_(2) {
  const Manifest& manifest = bundle.bundle.manifest;
  const ManifestNode node = manifest.root.at("mended");
  manifest.require_graphs({"mended"});
  before_ = size_t(node.at("before").integer(1, int(kMaxBefore)));
  trained_ = ForecastTimes::read(node);
  const int64_t side = bundle.frame_px;
  const Shape given{1, side, side, 3 * (int64_t(before_) + 1)}, times{1, 2};
  const GraphSpec& graph = manifest.graphs.at("mended");
  require_tensors(manifest, "mended", "inputs", graph.inputs, {{"pictures", given}, {"times", times}});
  require_tensors(manifest, "mended", "outputs", graph.outputs, {{"picture", bundle.frame_shape()}});
  session_ = std::make_unique<Session>(std::move(runtime), bundle.bundle.files.at(graph.file), graph,
                                       bundle.bundle.path_of(graph.file), settings);
  values_ = size_t(side) * size_t(side) * 3;
  given_.resize((before_ + 1) * values_);
  inputs_ = {{given_.data(), given}, {times_.data(), times}};
  outputs_ = {bundle.frame_shape()};
}

void MendedPicture::run(const uint8_t* const* frames, const uint8_t* foreseen, float step_s, float ahead_s,
                        float* picture) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const uint8_t* const oldest =
      *std::find_if(frames, frames + before_ - 1, [](auto frame) { return frame != nullptr; });
  for (size_t i = 0; i <= before_; ++i) {
    const uint8_t* const from = i == before_ ? foreseen : frames[i] != nullptr ? frames[i] : oldest;
    for (size_t pixel = 0; pixel < values_ / 3; ++pixel) {
      std::copy_n(from + 3 * pixel, 3, given_.data() + (pixel * (before_ + 1) + i) * 3);
    }
  }
  trained_.tell(step_s, ahead_s, times_.data());
  const float* const found = session_->run(inputs_, outputs_)[0].data;
  if (!are_finite(found, values_)) {
    throw Error(MAQ_ERROR_INFERENCE,
                "The network that mends pictures gave numbers that are not finite. Install the bundle again.");
  }
  std::copy_n(found, values_, picture);
}

}  // namespace maq
