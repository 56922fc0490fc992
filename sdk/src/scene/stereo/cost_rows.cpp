#include "scene/stereo/cost_rows.h"

#include "core/simd_clones.h"

namespace maq {

MAQ_SIMD_CLONES void sample_row(const uint32_t* __restrict quads, int quads_width, int quads_height,
                                const PixelRow& given, int count, int32_t* __restrict samples) {
  const PixelRow row = given;
  const float last_x = float(quads_width - 1), last_y = float(quads_height - 1);
  for (int i = 0; i < count; ++i) {
    const float x = float(i);
    const float z = row.at[2] + row.step[2] * x;
    const float inverse = 1.0f / z;
    const float u = (row.at[0] + row.step[0] * x) * inverse, v = (row.at[1] + row.step[1] * x) * inverse;
    const float over_u = u > 0.0f ? u : 0.0f, over_v = v > 0.0f ? v : 0.0f;
    const float in_u = over_u < last_x ? over_u : last_x, in_v = over_v < last_y ? over_v : last_y;
    const int column = int(in_u), line = int(in_v);
    const int right = int((in_u - float(column)) * 64.0f + 0.5f), down = int((in_v - float(line)) * 64.0f + 0.5f);
    const uint32_t quad = quads[line * quads_width + column];
    const int above = int(quad & 255u) * (64 - right) + int(quad >> 8 & 255u) * right;
    const int below = int(quad >> 16 & 255u) * (64 - right) + int(quad >> 24) * right;
    const int is_inside = int(in_u == u) & int(in_v == v) & int(z > 0.0f);
    samples[i] = ((above * (64 - down) + below * down + 2048) >> 12) + (1 - is_inside) * kOutside;
  }
}

MAQ_SIMD_CLONES void slide_columns(const int32_t* __restrict entering, const int32_t* __restrict entering_grey,
                                   const int32_t* __restrict leaving, const int32_t* __restrict leaving_grey,
                                   ColumnSums& sums) {
  const int count = int(sums.sample.size());
  int32_t *const __restrict sample = sums.sample.data(), *const __restrict square = sums.square.data(),
                 *const __restrict product = sums.product.data();
  for (int i = 0; i < count; ++i) {
    const int in = entering[i] & 255, out = leaving[i] & 255;
    sample[i] += in - out;
    square[i] += in * in - out * out;
    product[i] += in * entering_grey[i] - out * leaving_grey[i];
  }
}

MAQ_SIMD_CLONES void cost_row(const ColumnSums& sums, const int32_t* __restrict grey_sum,
                              const float* __restrict grey_scale, const int32_t* __restrict samples, int worst,
                              int count, int32_t* __restrict costs) {
  const int32_t *const sample = sums.sample.data(), *const square = sums.square.data(),
                       *const product = sums.product.data();
  for (int i = 0; i < count; ++i) {
    const auto over_window = [i](const int32_t* of) {
      return of[i] + of[i + 1] + of[i + 2] + of[i + 3] + of[i + 4] + of[i + 5] + of[i + 6];
    };
    const int sum = over_window(sample);
    const float spread = float(kWindowArea * over_window(square) - sum * sum);
    const float together = float(kWindowArea * over_window(product) - sum * grey_sum[i]);
    const float correlation = together * grey_scale[i] * inverse_root(spread + kMinSpread);
    const int rounded = int((1.0f - correlation) * float(worst) + 0.5f) | (samples[i] & kOutside);
    const int most = rounded < worst ? rounded : worst;
    costs[i] = most > 0 ? most : 0;
  }
}

MAQ_SIMD_CLONES void best_half(const uint8_t* __restrict a, const uint8_t* __restrict b, const uint8_t* __restrict c,
                               const uint8_t* __restrict d, int count, uint8_t* __restrict best) {
  for (int i = 0; i < count; ++i) {
    const uint8_t low = a[i] < b[i] ? a[i] : b[i], high = a[i] < b[i] ? b[i] : a[i];
    const uint8_t low2 = c[i] < d[i] ? c[i] : d[i], high2 = c[i] < d[i] ? d[i] : c[i];
    const uint8_t first = low < low2 ? low : low2, other = low < low2 ? low2 : low;
    const uint8_t highs = high < high2 ? high : high2;
    const uint8_t second = other < highs ? other : highs;
    best[i] = uint8_t((first + second + 1) >> 1);
  }
}

}  // namespace maq
