#include "prediction/flow/image_residual.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/rounding.h"
#include "core/simd_clones.h"
#include "prediction/flow/plane_samples.h"

namespace maq {
namespace {

constexpr int kTaskRows = 16;
using Weights = std::array<float, 3>;  // of R, G and B

// RGB weights of each channel of a plane.
struct PlaneWeights {
  size_t channels;
  std::array<Weights, 3> of;
};

// BT.601 in video range, like YUV frames. Alpha is not changed.
PlaneWeights weights_of(maq_pixel_format format, int plane) {
  constexpr Weights kRed{1, 0, 0}, kGreen{0, 1, 0}, kBlue{0, 0, 1};
  switch (format) {
    case MAQ_PIXEL_RGB8:
    case MAQ_PIXEL_RGBA8: return {3, {kRed, kGreen, kBlue}};
    case MAQ_PIXEL_BGR8: return {3, {kBlue, kGreen, kRed}};
    case MAQ_PIXEL_NV12:
    case MAQ_PIXEL_YUYV:
      if (plane == 0) return {1, {Weights{0.257f, 0.504f, 0.098f}}};
      return {2, {Weights{-0.148f, -0.291f, 0.439f}, Weights{0.439f, -0.368f, -0.071f}}};
    default: return {1, {Weights{0.299f, 0.587f, 0.114f}}};
  }
}

void mix(const float* upper, const float* lower, float weight, int count, float* mixed) {
  for (int i = 0; i < count; ++i) mixed[i] = upper[i] + (lower[i] - upper[i]) * weight;
}

// Resizes a row of `side` values to `width` pixels.
MAQ_SIMD_CLONES void stretch(const float* __restrict from, int side, int width, float* __restrict to) {
  const float step = float(side) / float(width), last = float(side - 1);
  for (int x = 0; x < width; ++x) {
    const float at = std::min(std::max((float(x) + 0.5f) * step - 0.5f, 0.0f), last);
    const int i = int(at), next = std::min(i + 1, side - 1);
    to[x] = from[i] + (from[next] - from[i]) * (at - float(i));
  }
}

// Rounds to the nearest byte.
MAQ_SIMD_CLONES void add_row(const float* __restrict residual, int width, int pixel_bytes, uint8_t* __restrict to) {
  for (int x = 0; x < width; ++x) {
    const float sum = float(to[x * pixel_bytes]) + residual[x];
    to[x * pixel_bytes] = uint8_t(std::min(std::max(sum, 0.0f), 255.0f) + 0.5f);
  }
}

bool is_seen(const float* values, int count) {
  return std::any_of(values, values + count, [](float value) { return std::abs(value) >= 0.5f; });
}

}  // namespace

void ImageResidual::add(const float* residual, int side, const ImageView& image, WorkerThreads& threads,
                        uint8_t* pixels) {
  const size_t area = size_t(side) * size_t(side);
  rows_.resize(size_t(threads.count()));
  PlaneSamples planes[2];
  const int count = plane_samples(image, pixels, planes);
  for (int plane = 0; plane < count; ++plane) {
    const PlaneSamples& samples = planes[plane];
    const auto [channels, weights] = weights_of(image.format, plane);
    channels_.resize(channels * area);
    for (size_t c = 0; c < channels; ++c) {
      for (size_t i = 0; i < area; ++i) {
        const float* const rgb = residual + 3 * i;
        channels_[c * area + i] = weights[c][0] * rgb[0] + weights[c][1] * rgb[1] + weights[c][2] * rgb[2];
      }
    }
    threads.run(size_t(divide_up(samples.height, kTaskRows)), [&, values = channels](size_t task, int worker) {
      Row& row = rows_[size_t(worker)];
      row.between.resize(size_t(side));
      row.wide.resize(size_t(samples.width));
      const int end = std::min(int(task + 1) * kTaskRows, samples.height);
      for (int y = int(task) * kTaskRows; y < end; ++y) {
        const float at =
            std::clamp((float(y) + 0.5f) * float(side) / float(samples.height) - 0.5f, 0.0f, float(side - 1));
        const size_t upper = size_t(at), lower = std::min(upper + 1, size_t(side - 1));
        for (size_t c = 0; c < values; ++c) {
          const float* const of_channel = channels_.data() + c * area;
          mix(of_channel + upper * size_t(side), of_channel + lower * size_t(side), at - float(upper), side,
              row.between.data());
          if (!is_seen(row.between.data(), side)) continue;
          stretch(row.between.data(), side, samples.width, row.wide.data());
          add_row(row.wide.data(), samples.width, samples.pixel_bytes,
                  samples.to + size_t(y) * samples.to_stride + c * size_t(samples.channel_bytes));
        }
      }
    });
  }
}

}  // namespace maq
