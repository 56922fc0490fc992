#include "image/turned_picture.h"

#include <opencv2/imgproc.hpp>

namespace maq {
namespace {

template <class Value>
void turn(const Raster<const Value>& from, int type, int how, const std::array<double, 6>& back,
          const Raster<Value>& to, int top, int bottom) {
  const cv::Mat given(from.height_px, from.width_px, type, const_cast<Value*>(from.pixels));
  cv::Mat rows = cv::Mat(to.height_px, to.width_px, type, to.pixels).rowRange(top, bottom);
  const cv::Matx23d map(back[0], back[1], back[1] * top + back[2], back[3], back[4], back[4] * top + back[5]);
  cv::warpAffine(given, rows, map, rows.size(), how | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
}

}  // namespace

void turn_bytes(const Raster<const uint8_t>& from, int channels, const std::array<double, 6>& back,
                const Raster<uint8_t>& to, int top, int bottom) {
  turn(from, CV_8UC(channels), cv::INTER_LINEAR, back, to, top, bottom);
}

void turn_depths(const Raster<const float>& from, const std::array<double, 6>& back, const Raster<float>& to, int top,
                 int bottom) {
  turn(from, CV_32FC1, cv::INTER_NEAREST, back, to, top, bottom);
}

}  // namespace maq
