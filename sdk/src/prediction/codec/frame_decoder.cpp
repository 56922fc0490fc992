#include "prediction/codec/frame_decoder.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/math/finite.h"

namespace maq {

FrameDecoder::FrameDecoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const CodeBundle& bundle,
                           const SessionSettings& settings)
    : runtime_(std::move(runtime)),
      codes_(bundle.codes),
      frame_px_(bundle.frame_px),
      input_shape_(bundle.features_shape()),
      output_shapes_{bundle.frame_shape()},
      graph_(bundle.bundle.manifest.graphs.at("decoder")),
      name_(bundle.bundle.path_of(graph_.file)),
      settings_(settings),
      bytes_(bundle.bundle.files.at(graph_.file)) {}

void FrameDecoder::look_up(const uint16_t* codes) {
  const size_t width = codes_->width;
  features_.resize(codes_->count() * width);
  for (size_t i = 0; i < codes_->count(); ++i) {
    const size_t entry = i % codes_->groups * codes_->entries + codes[i];
    std::copy_n(codes_->vectors.data() + entry * width, width, features_.data() + i * width);
  }
}

const float* FrameDecoder::run(const uint16_t* codes) {
  look_up(codes);
  if (session_ == nullptr) {
    session_ = open_session(runtime_, bytes_, graph_, name_, settings_);
    bytes_ = {};
  }
  inputs_.assign(1, {features_.data(), input_shape_});
  const float* const image = session_->run(inputs_, output_shapes_)[0].data;
  if (!are_finite(image, values())) {
    throw Error(MAQ_ERROR_INFERENCE,
                "The decoder of frames gave numbers that are not finite. Install the bundle again.");
  }
  return image;
}

void FrameDecoder::decode(const uint16_t* codes, uint8_t* rgb) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const float* const image = run(codes);
  std::transform(image, image + values(), rgb,
                 [](float value) { return uint8_t(std::clamp(value, 0.0f, 255.0f) + 0.5f); });
}

void FrameDecoder::decode(const uint16_t* codes, float* rgb) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::copy_n(run(codes), values(), rgb);
}

}  // namespace maq
