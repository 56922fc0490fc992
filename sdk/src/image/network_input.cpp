#include "image/network_input.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "image/opencv_view.h"

namespace maq {
namespace {

int round_up(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }

// Pixels are bytes, so normalising one is a look-up among 256 values.
std::array<float, 256> normalisation_table(float mean, float std) {
  std::array<float, 256> table{};
  for (size_t value = 0; value < table.size(); ++value) table[value] = (float(value) - mean) / std;
  return table;
}

}  // namespace

void network_size(int width_px, int height_px, int long_side_px, int* network_width_px, int* network_height_px) {
  const double scale = double(long_side_px) / std::max(width_px, height_px);
  *network_width_px = std::max(1, int(std::nearbyint(width_px * scale)));
  *network_height_px = std::max(1, int(std::nearbyint(height_px * scale)));
}

void make_network_input(const ImageView& image, const NetworkInputSpec& spec, NetworkInput& input) {
  network_size(image.width_px, image.height_px, spec.long_side_px, &input.width_px, &input.height_px);
  input.padded_width_px = round_up(input.width_px, spec.multiple_of);
  input.padded_height_px = round_up(input.height_px, spec.multiple_of);

  cv::Mat bgr = as_bgr(image);
  if (bgr.cols != input.width_px || bgr.rows != input.height_px) {
    const bool shrinks = spec.long_side_px < std::max(image.width_px, image.height_px);
    cv::Mat resized;
    cv::resize(bgr, resized, cv::Size(input.width_px, input.height_px), 0, 0,
               shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
    bgr = resized;
  }

  const size_t plane = size_t(input.padded_width_px) * size_t(input.padded_height_px);
  input.values.assign(3 * plane, 0.0f);
  const std::array<float, 256> tables[3] = {normalisation_table(spec.mean[0], spec.std[0]),
                                            normalisation_table(spec.mean[1], spec.std[1]),
                                            normalisation_table(spec.mean[2], spec.std[2])};
  for (int y = 0; y < input.height_px; ++y) {
    const uint8_t* pixel = bgr.ptr<uint8_t>(y);
    float* red = input.values.data() + size_t(y) * size_t(input.padded_width_px);
    float* green = red + plane;
    float* blue = green + plane;
    for (int x = 0; x < input.width_px; ++x, pixel += 3) {
      blue[x] = tables[2][pixel[0]];
      green[x] = tables[1][pixel[1]];
      red[x] = tables[0][pixel[2]];
    }
  }
}

}  // namespace maq
