#include "prediction/flow/pixel_warp.h"

#include <algorithm>
#include <cstring>

#include "core/simd_clones.h"

namespace maq {
namespace {

constexpr int kRun_px = 32;  // that is copied at once where nothing moves

void mix_rows(const float* __restrict upper, const float* __restrict lower, float weight, int width, float factor,
              float* __restrict mixed) {
  for (int x = 0; x < width; ++x) mixed[x] = (upper[x] + (lower[x] - upper[x]) * weight) * factor;
}

// A row of the field at each pixel of a plane; `step` is how many of the field's pixels one of the plane's is.
MAQ_SIMD_CLONES void stretch_row(const float* __restrict from, int from_width, float step, int width,
                                 float* __restrict to) {
  const float last = float(from_width - 1);
  for (int x = 0; x < width; ++x) {
    const float at = std::min(std::max((float(x) + 0.5f) * step - 0.5f, 0.0f), last);
    const int i = int(at), next = std::min(i + 1, from_width - 1);
    to[x] = from[i] + (from[next] - from[i]) * (at - float(i));
  }
}

MAQ_SIMD_CLONES void find_positions(const float* __restrict dx, const float* __restrict dy, int width, int height,
                                    int y, int pixel_bytes, int* __restrict left, int* __restrict right,
                                    int* __restrict x_weight, int* __restrict above, int* __restrict below,
                                    int* __restrict y_weight) {
  const float last_x = float(width - 1), last_y = float(height - 1), at_y = float(y);
  for (int x = 0; x < width; ++x) {
    const float from_x = std::min(std::max(float(x) + dx[x], 0.0f), last_x);
    const float from_y = std::min(std::max(at_y + dy[x], 0.0f), last_y);
    const int whole_x = int(from_x), whole_y = int(from_y);
    left[x] = whole_x * pixel_bytes;
    right[x] = std::min(whole_x + 1, width - 1) * pixel_bytes;
    x_weight[x] = int((from_x - float(whole_x)) * 256.0f + 0.5f);
    above[x] = whole_y;
    below[x] = std::min(whole_y + 1, height - 1);
    y_weight[x] = int((from_y - float(whole_y)) * 256.0f + 0.5f);
  }
}

bool moves(const float* dx, const float* dy, int count) {
  int any = 0;
  for (int i = 0; i < count; ++i) any |= int(dx[i] != 0) | int(dy[i] != 0);
  return any != 0;
}

using FourBytes = uint8_t __attribute__((vector_size(4)));
using FourWords = uint16_t __attribute__((vector_size(8)));

inline FourWords four_words(const uint8_t* bytes) {
  FourBytes four;
  std::memcpy(&four, bytes, sizeof four);
  return __builtin_convertvector(four, FourWords);
}

inline FourWords mix(FourWords one, FourWords other, int weight) {
  return (one * uint16_t(256 - weight) + other * uint16_t(weight) + 128) >> 8;
}

// Reads pixels of three or four bytes, and one byte more.
MAQ_SIMD_CLONES void fetch_colours(const PlaneSamples& plane, const WarpRow& row, int y, int begin, int end) {
  const size_t channels = size_t(plane.channels);
  const int *const __restrict above = row.above.data(), *const __restrict below = row.below.data(),
                              *const __restrict left = row.left.data(), *const __restrict right = row.right.data(),
                              *const __restrict x_weight = row.x_weight.data(),
                              *const __restrict y_weight = row.y_weight.data();
  const uint8_t* const __restrict from = plane.from;
  const size_t stride = plane.from_stride;
  uint8_t* __restrict to = plane.to + size_t(y) * plane.to_stride + size_t(begin) * channels;
  for (int x = begin; x < end; ++x, to += channels) {
    const uint8_t* const upper = from + size_t(above[x]) * stride;
    const uint8_t* const lower = from + size_t(below[x]) * stride;
    const FourWords mixed =
        mix(mix(four_words(upper + left[x]), four_words(upper + right[x]), x_weight[x]),
            mix(four_words(lower + left[x]), four_words(lower + right[x]), x_weight[x]), y_weight[x]);
    const FourBytes four = __builtin_convertvector(mixed, FourBytes);
    if (x + 1 < end) {
      std::memcpy(to, &four, 4);  // a byte of the next pixel, too
    } else {
      std::memcpy(to, &four, channels);
    }
  }
}

void fetch_values(const PlaneSamples& plane, const WarpRow& row, int y, int begin, int end) {
  for (size_t x = size_t(begin); x < size_t(end); ++x) {
    const uint8_t* const above = plane.from + size_t(row.above[x]) * plane.from_stride;
    const uint8_t* const below = plane.from + size_t(row.below[x]) * plane.from_stride;
    const int left = row.left[x], right = row.right[x], x_weight = row.x_weight[x], y_weight = row.y_weight[x];
    uint8_t* const to = plane.to + size_t(y) * plane.to_stride + x * size_t(plane.pixel_bytes);
    for (int channel = 0; channel < plane.channels * plane.channel_bytes; channel += plane.channel_bytes) {
      const int upper = above[left + channel] * (256 - x_weight) + above[right + channel] * x_weight;
      const int lower = below[left + channel] * (256 - x_weight) + below[right + channel] * x_weight;
      to[channel] = uint8_t((upper * (256 - y_weight) + lower * y_weight + (1 << 15)) >> 16);
    }
  }
}

inline uint8_t mix(uint8_t one, uint8_t other, int weight) {
  return uint8_t((one * (256 - weight) + other * weight + 128) >> 8);
}

// Weights by byte, of 256.
void mix_bytes(const uint8_t* __restrict from, uint8_t* __restrict to, const uint16_t* __restrict weights, int count) {
  for (int i = 0; i < count; ++i) {
    to[i] = uint8_t(uint16_t(from[i] * (256 - weights[i]) + to[i] * weights[i] + 128) >> 8);
  }
}

void mix_run(const PlaneSamples& plane, const uint8_t* from, uint8_t* to, const float* weights, int count,
             std::vector<uint16_t>& of_bytes) {
  if (plane.channels * plane.channel_bytes == plane.pixel_bytes) {
    of_bytes.resize(size_t(count) * size_t(plane.channels));
    uint16_t* next = of_bytes.data();
    for (int x = 0; x < count; ++x) {
      const auto weight = uint16_t(weights[x] + 0.5f);
      for (int channel = 0; channel < plane.channels; ++channel) *next++ = weight;
    }
    return mix_bytes(from, to, of_bytes.data(), int(of_bytes.size()));
  }
  for (int x = 0; x < count; ++x) {
    const int weight = int(weights[x] + 0.5f);
    for (int channel = 0; channel < plane.channels; ++channel) {
      const int at = x * plane.pixel_bytes + channel * plane.channel_bytes;
      to[at] = mix(from[at], to[at], weight);
    }
  }
}

}  // namespace

void warp_row(const PlaneSamples& plane, const FlowField& field, int scale, int y, WarpRow& row) {
  const size_t field_width = size_t(field.width_px), width = size_t(plane.width);
  row.upper_dx.resize(field_width);
  row.upper_dy.resize(field_width);
  row.dx.resize(width);
  row.dy.resize(width);
  for (std::vector<int>* all : {&row.left, &row.right, &row.x_weight, &row.above, &row.below, &row.y_weight}) {
    all->resize(width);
  }
  const float step_x = float(plane.subsampled_x) / float(scale), step_y = float(plane.subsampled_y) / float(scale);
  const float at = std::clamp((float(y) + 0.5f) * step_y - 0.5f, 0.0f, float(field.height_px - 1));
  const size_t upper = size_t(at), lower = std::min(upper + 1, size_t(field.height_px - 1));
  const float weight = at - float(upper);
  mix_rows(field.dx_px.data() + upper * field_width, field.dx_px.data() + lower * field_width, weight, field.width_px,
           1 / step_x, row.upper_dx.data());
  mix_rows(field.dy_px.data() + upper * field_width, field.dy_px.data() + lower * field_width, weight, field.width_px,
           1 / step_y, row.upper_dy.data());
  stretch_row(row.upper_dx.data(), field.width_px, step_x, plane.width, row.dx.data());
  stretch_row(row.upper_dy.data(), field.width_px, step_x, plane.width, row.dy.data());
  find_positions(row.dx.data(), row.dy.data(), plane.width, plane.height, y, plane.pixel_bytes, row.left.data(),
                 row.right.data(), row.x_weight.data(), row.above.data(), row.below.data(), row.y_weight.data());
  const bool is_packed = plane.channels * plane.channel_bytes == plane.pixel_bytes;
  for (int begin = 0; begin < plane.width; begin += kRun_px) {
    const int end = std::min(begin + kRun_px, plane.width);
    if (is_packed && !moves(row.dx.data() + begin, row.dy.data() + begin, end - begin)) {
      const size_t from = size_t(begin) * size_t(plane.pixel_bytes);
      std::memcpy(plane.to + size_t(y) * plane.to_stride + from, plane.from + size_t(y) * plane.from_stride + from,
                  size_t(end - begin) * size_t(plane.pixel_bytes));
    } else if (plane.channels >= 3) {
      fetch_colours(plane, row, y, begin, end);
    } else {
      fetch_values(plane, row, y, begin, end);
    }
  }
}

void blend_row(const PlaneSamples& plane, const CellWeights& weights, int scale, int y, WarpRow& row) {
  const size_t columns = size_t(weights.columns);
  row.cell_weights.resize(columns);
  row.weights.resize(size_t(plane.width));
  const float cell_px = float(scale * weights.cell_px);
  const float step_x = float(plane.subsampled_x) / cell_px, step_y = float(plane.subsampled_y) / cell_px;
  const float at = std::clamp((float(y) + 0.5f) * step_y - 0.5f, 0.0f, float(weights.rows - 1));
  const size_t upper = size_t(at), lower = std::min(upper + 1, size_t(weights.rows - 1));
  mix_rows(weights.weights.data() + upper * columns, weights.weights.data() + lower * columns, at - float(upper),
           weights.columns, 256, row.cell_weights.data());
  const auto is_all = [](float weight) { return weight >= 256; };
  if (std::all_of(row.cell_weights.begin(), row.cell_weights.end(), is_all)) return;
  stretch_row(row.cell_weights.data(), weights.columns, step_x, plane.width, row.weights.data());
  mix_run(plane, plane.from + size_t(y) * plane.from_stride, plane.to + size_t(y) * plane.to_stride, row.weights.data(),
          plane.width, row.byte_weights);
}

}  // namespace maq
