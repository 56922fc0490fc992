#include "output/frame_image.h"

Canvas image_of(const maquette::Frame& frame) {
  const maq_frame_desc desc = frame.desc();
  Canvas image({desc.width_px, desc.height_px});
  frame.copy_pixels(MAQ_PIXEL_BGR8, image.bgr.data(), 0, image.bgr.size());
  return image;
}

namespace {

maquette::Frame frame_of(const maquette::Context& context, PictureSide size, const void* bgr, size_t stride_bytes) {
  maq_frame_desc desc;
  maquette::check(maq_frame_desc_init(&desc, sizeof desc));
  desc.format = MAQ_PIXEL_BGR8;
  desc.width_px = size.width;
  desc.height_px = size.height;
  desc.planes[0] = static_cast<const uint8_t*>(bgr);
  desc.stride_bytes[0] = stride_bytes;
  return maquette::Frame(context, desc);
}

}  // namespace

maquette::Frame frame_of(const maquette::Context& context, const Canvas& image) {
  return frame_of(context, image.size(), image.bgr.data(), 0);
}

maquette::Frame frame_of(const maquette::Context& context, const maquette::Image& image) {
  size_t stride_bytes = 0;
  const void* const bgr = image.plane(MAQ_IMAGE_PLANE_BGR, &stride_bytes);
  return frame_of(context, {image.width_px(), image.height_px()}, bgr, stride_bytes);
}
