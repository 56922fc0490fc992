#include "prediction/codec/frame_encoder.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "core/math/finite.h"
#include "nn/thread_choice.h"

namespace maq {

FrameEncoder::FrameEncoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                           SessionSettings settings)
    : codes_(bundle.codes),
      nearest_(*codes_),
      frame_px_(bundle.frame_px),
      input_shape_(bundle.frame_shape()),
      output_shapes_{bundle.features_shape()} {
  const GraphSpec& graph = bundle.bundle.manifest.graphs.at("encoder");
  const std::vector<uint8_t>& bytes = bundle.bundle.files.at(graph.file);
  const std::string name = bundle.bundle.path_of(graph.file);
  if (settings.threads == MAQ_THREADS_MEASURED) {
    settings.threads =
        measure_threads(runtime, {bytes, graph, name, frame_px_, frame_px_, input_shape_, output_shapes_}, settings);
  }
  threads_ = settings.threads;
  session_ = open_session(std::move(runtime), bytes, graph, name, settings);
}

void FrameEncoder::resize(const ImageView& image) {
  if (is_depth(image.format)) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "A depth image has no codes; give a colour or grey image.");
  }
  NetworkInputSpec in_bytes;
  in_bytes.std = {1, 1, 1};
  make_network_input(image, {frame_px_, frame_px_}, in_bytes, resized_);
  const size_t pixels = size_t(frame_px_) * size_t(frame_px_);
  image_.resize(3 * pixels);
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t c = 0; c < 3; ++c) image_[3 * i + c] = std::floor(resized_.values[c * pixels + i] + 0.5f);
  }
}

void FrameEncoder::resize_to_input(const ImageView& image, uint8_t* input_rgb) {
  const std::lock_guard<std::mutex> lock(mutex_);
  resize(image);
  std::transform(image_.begin(), image_.end(), input_rgb, [](float value) { return uint8_t(value); });
}

EncoderTimes FrameEncoder::encode(const ImageView& image, uint16_t* codes, uint8_t* input_rgb) {
  const std::lock_guard<std::mutex> lock(mutex_);
  EncoderTimes times;
  Stopwatch stage;
  resize(image);
  if (input_rgb != nullptr) {
    std::transform(image_.begin(), image_.end(), input_rgb, [](float value) { return uint8_t(value); });
  }
  times.resize_ms = float(stage.lap_ms());

  inputs_.assign(1, {image_.data(), input_shape_});
  const float* const features = session_->run(inputs_, output_shapes_)[0].data;
  times.network_ms = float(stage.lap_ms());
  if (!are_finite(features, codes_->count() * codes_->width)) {
    throw Error(MAQ_ERROR_INFERENCE,
                "The encoder of frames returned numbers that are not finite. Install the bundle again.");
  }
  nearest_.run(features, codes_->cells(), codes);
  times.nearest_ms = float(stage.lap_ms());
  return times;
}

}  // namespace maq
