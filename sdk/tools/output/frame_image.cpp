#include "output/frame_image.h"

cv::Mat image_of(const maquette::Frame& frame) {
  const maq_frame_desc desc = frame.desc();
  cv::Mat image(desc.height_px, desc.width_px, CV_8UC3);
  frame.copy_pixels(MAQ_PIXEL_BGR8, image.data, image.step, image.total() * 3);
  return image;
}

maquette::Frame frame_of(const maquette::Context& context, const cv::Mat& image) {
  maq_frame_desc desc;
  maquette::check(maq_frame_desc_init(&desc, sizeof desc));
  desc.format = MAQ_PIXEL_BGR8;
  desc.width_px = image.cols;
  desc.height_px = image.rows;
  desc.planes[0] = image.data;
  desc.stride_bytes[0] = image.step;
  return maquette::Frame(context, desc);
}
