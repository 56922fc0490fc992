#include "image/network_input.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"
#include "core/simd_clones.h"
#include "image/convert.h"

namespace maq {
namespace {

constexpr int kChannels = 3;

// row[i] = sum of weight[k] * line_k[i] over the taps' lines. The compiler makes vectors of it.
MAQ_SIMD_CLONES void weighted_lines(const uint8_t* first_line, size_t stride_bytes, const float* weight, int taps,
                                    size_t count, float* row) {
  for (size_t i = 0; i < count; ++i) row[i] = weight[0] * float(first_line[i]);
  for (int k = 1; k < taps; ++k) {
    if (weight[k] == 0) continue;
    const uint8_t* line = first_line + size_t(k) * stride_bytes;
    for (size_t i = 0; i < count; ++i) row[i] += weight[k] * float(line[i]);
  }
}

}  // namespace

void ResizeAxis::prepare(int from, int to, bool shrinks) {
  if (from_px == from && to_px == to) return;
  from_px = to_px = 0;  // until it is made: memory may fail
  const double scale = double(from) / double(to);
  taps = std::min(from, shrinks ? int(std::ceil(scale)) + 1 : 2);
  first.assign(size_t(to), 0);
  weight.assign(size_t(to) * size_t(taps), 0);
  for (int i = 0; i < to; ++i) {
    float* weights = weight.data() + size_t(i) * size_t(taps);
    // The interval of old pixels, or the point between two, that the new pixel covers.
    const double low = shrinks ? i * scale : std::clamp((i + 0.5) * scale - 0.5, 0.0, double(from - 1));
    const double high = shrinks ? std::min((i + 1) * scale, double(from)) : low + 1;
    first[size_t(i)] = std::clamp(int(std::floor(low + 1e-9)), 0, from - taps);
    double sum = 0;
    for (int k = 0; k < taps; ++k) {
      const double cell = first[size_t(i)] + k;
      const double covered = std::max(0.0, std::min(high, cell + 1) - std::max(low, cell));
      weights[k] = float(covered);
      sum += covered;
    }
    for (int k = 0; k < taps; ++k) weights[k] = float(weights[k] / sum);
  }
  from_px = from;
  to_px = to;
}

NetworkSize network_size(int width_px, int height_px, int long_side_px) {
  const double scale = double(long_side_px) / std::max(width_px, height_px);
  const auto scaled = [&](int side_px) { return std::max(1, int(std::nearbyint(side_px * scale))); };
  return {scaled(width_px), scaled(height_px)};
}

void make_network_input(const ImageView& image, const NetworkSize& size, const NetworkInputSpec& spec,
                        NetworkInput& input) {
  input.width_px = size.width_px;
  input.height_px = size.height_px;
  input.padded_width_px = round_up(input.width_px, spec.multiple_of);
  input.padded_height_px = round_up(input.height_px, spec.multiple_of);

  const ImageView bgr = as_bgr(image, input.converted);
  const bool shrinks = std::max(size.width_px, size.height_px) < std::max(image.width_px, image.height_px);
  input.columns.prepare(image.width_px, input.width_px, shrinks);
  input.rows.prepare(image.height_px, input.height_px, shrinks);
  const size_t row_values = size_t(image.width_px) * kChannels;
  input.row.resize(row_values);

  const size_t plane = size_t(input.padded_width_px) * size_t(input.padded_height_px);
  input.values.resize(kChannels * plane);
  float scale[kChannels], shift[kChannels];
  for (size_t c = 0; c < kChannels; ++c) {
    scale[c] = 1 / spec.std[c];
    shift[c] = -spec.mean[c] / spec.std[c];
  }
  const int taps = input.columns.taps;
  for (int y = 0; y < input.padded_height_px; ++y) {
    float* red = input.values.data() + size_t(y) * size_t(input.padded_width_px);
    float* green = red + plane;
    float* blue = green + plane;
    const int used = y < input.height_px ? input.width_px : 0;
    for (float* line : {red, green, blue}) std::fill(line + used, line + input.padded_width_px, 0.0f);
    if (used == 0) continue;
    weighted_lines(bgr.planes[0].data + size_t(input.rows.first[size_t(y)]) * bgr.planes[0].stride_bytes,
                   bgr.planes[0].stride_bytes, input.rows.weight.data() + size_t(y) * size_t(input.rows.taps),
                   input.rows.taps, row_values, input.row.data());
    const float* weight = input.columns.weight.data();
    for (int x = 0; x < used; ++x, weight += taps) {
      const float* pixel = input.row.data() + kChannels * input.columns.first[size_t(x)];
      float b = 0, g = 0, r = 0;
      for (int k = 0; k < taps; ++k, pixel += kChannels) {
        b += weight[k] * pixel[0];
        g += weight[k] * pixel[1];
        r += weight[k] * pixel[2];
      }
      red[x] = r * scale[0] + shift[0];
      green[x] = g * scale[1] + shift[1];
      blue[x] = b * scale[2] + shift[2];
    }
  }
}

}  // namespace maq
