// Frames, for C++17; a part of maquette.hpp.
#ifndef MAQUETTE_FRAME_HPP_
#define MAQUETTE_FRAME_HPP_

#include <optional>
#include <string>
#include <utility>

#include "maquette/context.hpp"
#include "maquette/frame.h"

namespace maquette {

class Frame {
 public:
  // Takes ownership of a frame from the C API.
  explicit Frame(maq_frame* frame) : owner_(frame) {}
  // Refers to the frame of a pipeline's result.
  explicit Frame(PartOf<maq_frame> part) : owner_(const_cast<maq_frame*>(part.handle), {std::move(part.whole)}) {}

  // Wraps pixels of the app, which must outlive the frame.
  Frame(const Context& context, const maq_frame_desc& desc) {
    maq_frame* made = nullptr;
    check(maq_frame_wrap(context.get(), &desc, nullptr, nullptr, &made));
    owner_.reset(made);
  }

  // Decodes an image file in memory: `size_bytes` at `data`, which may be freed afterwards.
  static Frame decode(const Context& context, const void* data, size_t size_bytes) {
    maq_frame* made = nullptr;
    check(maq_frame_decode(context.get(), data, size_bytes, &made));
    return Frame(made);
  }

  // Copies an image in planes of Y, U and V, which may be freed afterwards.
  static Frame convert_yuv(const Context& context, const maq_yuv_image& image) {
    maq_frame* made = nullptr;
    check(maq_frame_convert_yuv(context.get(), &image, &made));
    return Frame(made);
  }

  maq_frame* get() const { return owner_.get(); }

  maq_frame_desc desc() const {
    maq_frame_desc desc{};
    desc.struct_size = sizeof desc;
    check(maq_frame_get_desc(get(), &desc));
    return desc;
  }

  // Returns nothing when they are unknown.
  std::optional<maq_intrinsics> intrinsics() const {
    const maq_intrinsics known = desc().intrinsics;
    return known.width_px > 0 ? std::optional(known) : std::nullopt;
  }

  maq_frame_origin origin() const {
    maq_frame_origin origin{};
    origin.struct_size = sizeof origin;
    check(maq_frame_get_origin(get(), &origin));
    return origin;
  }
  // True for a frame from a predictor or a concealer.
  bool is_predicted() const { return origin().kind == MAQ_FRAME_PREDICTED; }

  // Returns nothing for a frame without depth.
  std::optional<maq_frame_desc> depth() const {
    maq_frame_desc desc{};
    desc.struct_size = sizeof desc;
    const maq_status status = maq_frame_get_depth(get(), &desc);
    if (status == MAQ_ERROR_UNSUPPORTED) return std::nullopt;
    check(status);
    return desc;
  }

  void copy_pixels(maq_pixel_format format, uint8_t* pixels, size_t stride_bytes, size_t size_bytes) const {
    check(maq_frame_copy_pixels(get(), format, pixels, stride_bytes, size_bytes));
  }

  // Returns a copy in BGR.
  Frame resized(int32_t width_px, int32_t height_px) const {
    maq_frame* made = nullptr;
    check(maq_frame_resize(get(), width_px, height_px, &made));
    return Frame(made);
  }

  void save(const std::string& path) const { check(maq_frame_save(get(), path.c_str())); }

 private:
  Owner<maq_frame, maq_frame_release> owner_;
};

}  // namespace maquette

#endif  // MAQUETTE_FRAME_HPP_
