// The colours of one person on the body surface, which grow from frame to frame.
#pragma once

#include <cstdint>
#include <maquette/maquette.hpp>
#include <memory>
#include <optional>
#include <string>

#include "app/rgba_image.h"

namespace maquette {

// One thread at a time.
class GrowingTexture {
 public:
  explicit GrowingTexture(const Context& context) : context_(context) {}

  // Adds what a frame shows of the person. That is the largest one of the first frame with people; when this person
  // has been away for 90 frames, it begins again with the largest one then.
  void add(const DensePoseResult& result, const Frame& frame);

  // Begins again if the frames now come from another source, where ids begin anew.
  void set_source(const std::string& uri) {
    if (uri != source_) texture_.reset();
    source_ = uri;
  }

  // The texture as maq_densepose_texture_draw describes it, of one of the last eight frames; null before there is one.
  const std::shared_ptr<const RgbaImage>& image() const { return image_; }

 private:
  const Context& context_;
  std::optional<DensePoseTexture> texture_;
  std::string source_;
  int64_t person_ = 0;  // whose texture it is
  int frames_away_ = 0, frames_since_drawn_ = 0;
  std::shared_ptr<const RgbaImage> image_;
};

}  // namespace maquette
