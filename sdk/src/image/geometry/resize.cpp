#include "image/geometry/resize.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/simd_clones.h"
#include "image/convert.h"

namespace maq {
namespace {

using Source = BytePicture<const uint8_t>;
using Target = BytePicture<uint8_t>;

const uint8_t* row_of(const Source& picture, int row) { return picture.pixels + size_t(row) * picture.stride_bytes; }
uint8_t* row_of(const Target& picture, int row) { return picture.pixels + size_t(row) * picture.stride_bytes; }

// How many old pixels a new one is wide, by way of its inverse: the last bit of it decides weights.
double pixels_per_pixel(int from_px, int to_px) { return 1 / (double(to_px) / double(from_px)); }

// Rounds to the nearest, halves to even. Adding 1.5 * 2^23 leaves no bits for a fraction; `value` is 0 to 255.
inline uint8_t rounded(float value) {
  constexpr float kNoFraction = 12582912;
  return uint8_t(int(value + kNoFraction) - int(kNoFraction));
}

MAQ_SIMD_CLONES void to_floats(const uint8_t* from, size_t count, float* to) {
  for (size_t i = 0; i < count; ++i) to[i] = float(from[i]);
}

// --- bilinear: weights of 11 fractional bits, the vertical sum of rows that lost 4 of them
// -----------------------------

// The two old pixels around each new one, and their weights.
struct LinearAxis {
  struct Between {
    int first, second;
    float first_weight, second_weight;  // whole numbers
  };
  std::vector<Between> at;

  // Before the first centre OpenCV keeps the weights of rows, which both count for the first row, but not the weights
  // of columns.
  LinearAxis(int from_px, int to_px, bool are_columns) : at(size_t(to_px)) {
    const double scale = pixels_per_pixel(from_px, to_px);
    for (int i = 0; i < to_px; ++i) {
      float fraction = float((i + 0.5) * scale - 0.5);
      const int floor = int(std::floor(fraction));
      fraction -= float(floor);
      if (are_columns && (floor < 0 || floor >= from_px - 1)) fraction = 0;
      const auto weight = [](float of_one) { return float(std::nearbyint(of_one * (1 << 11))); };
      at[size_t(i)] = {std::clamp(floor, 0, from_px - 1), std::clamp(floor + 1, 0, from_px - 1), weight(1 - fraction),
                       weight(fraction)};
    }
  }
};

// `from` and `to` have a value more than their rows have. Products and sums are exact in floats. `lanes` is a power of
// two, so that a pixel is one vector.
template <int channels>
void blend_columns(const float* from, const LinearAxis& axis, float* to) {
  constexpr int lanes = channels == 3 ? 4 : channels;
  for (const LinearAxis::Between at : axis.at) {
    const float* const first = from + at.first * channels;
    const float* const second = from + at.second * channels;
    float blended[lanes];
    for (int c = 0; c < lanes; ++c) blended[c] = first[c] * at.first_weight + second[c] * at.second_weight;
    for (int c = 0; c < lanes; ++c) to[c] = blended[c];
    to += channels;
  }
}

// Less than 2^15 when the last 4 bits are gone.
MAQ_SIMD_CLONES void drop_last_bits(const float* from, size_t count, int16_t* to) {
  for (size_t i = 0; i < count; ++i) to[i] = int16_t(int(from[i]) >> 4);
}

MAQ_SIMD_CLONES void blend_rows(const int16_t* first, const int16_t* second, int16_t first_weight,
                                int16_t second_weight, size_t count, uint8_t* to) {
  for (size_t i = 0; i < count; ++i) {
    const int16_t upper = int16_t((first_weight * first[i]) >> 16), lower = int16_t((second_weight * second[i]) >> 16);
    to[i] = uint8_t(uint16_t(upper + lower + 2) >> 2);
  }
}

void resize_bilinear(const Source& from, const Target& to) {
  const auto blend = to.channels == 1 ? blend_columns<1> : to.channels == 3 ? blend_columns<3> : blend_columns<4>;
  const LinearAxis columns(from.width_px, to.width_px, true), rows(from.height_px, to.height_px, false);
  const size_t from_values = size_t(from.width_px) * size_t(from.channels);
  const size_t values = size_t(to.width_px) * size_t(to.channels);
  std::vector<float> line(from_values + 1), sums(values + 1);
  std::vector<int16_t> memory(2 * values);
  int16_t* blended[2] = {memory.data(), memory.data() + values};
  int blended_row[2] = {-1, -1};
  for (int y = 0; y < to.height_px; ++y) {
    const LinearAxis::Between& at = rows.at[size_t(y)];
    if (blended_row[1] == at.first) {
      std::swap(blended[0], blended[1]);
      std::swap(blended_row[0], blended_row[1]);
    }
    const int wanted[2] = {at.first, at.second};
    for (int i = 0; i < 2; ++i) {
      if (blended_row[i] == wanted[i]) continue;
      to_floats(row_of(from, wanted[i]), from_values, line.data());
      blend(line.data(), columns, sums.data());
      drop_last_bits(sums.data(), values, blended[i]);
      blended_row[i] = wanted[i];
    }
    blend_rows(blended[0], blended[1], int16_t(at.first_weight), int16_t(at.second_weight), values, row_of(to, y));
  }
}

// --- area, where each new pixel covers a whole number of old ones: exact sums
// -------------------------------------------

MAQ_SIMD_CLONES void add_row(const uint8_t* from, size_t count, int* sums) {
  for (size_t i = 0; i < count; ++i) sums[i] += from[i];
}

// `sums` are those of the columns; each pixel is the mean of `factor` of them, which are of `pixels` old pixels.
template <int channels>
void average_columns(const int* sums, int factor, int pixels, int width, uint8_t* to) {
  const float weight = 1.0f / float(pixels);
  for (int x = 0; x < width; ++x, to += channels) {
    int all[channels] = {};
    for (int i = 0; i < factor; ++i, sums += channels) {
      for (int c = 0; c < channels; ++c) all[c] += sums[c];
    }
    for (int c = 0; c < channels; ++c) to[c] = rounded(float(all[c]) * weight);
  }
}

// means[i]: that of four neighbours, halves rounded up, as those `step` bytes apart of both rows.
MAQ_SIMD_CLONES void average_neighbours(const uint8_t* upper, const uint8_t* lower, size_t step, size_t count,
                                        uint8_t* means) {
  for (size_t i = 0; i < count; ++i) {
    const unsigned sum = unsigned(upper[i]) + upper[i + step] + lower[i] + lower[i + step];
    means[i] = uint8_t((sum + 2) >> 2);
  }
}

// Every other pixel of `from`, which has room for a byte after its last.
template <size_t channels>
void take_every_other(const uint8_t* from, int width, uint8_t* to) {
  constexpr size_t whole = channels == 3 ? 4 : channels;  // with a byte of the next pixel, which is written over
  for (int x = 0; x + 1 < width; ++x, from += 2 * channels, to += channels) std::memcpy(to, from, whole);
  std::memcpy(to, from, channels);
}

// Averages all neighbours and takes every other mean: two plain loops, the first of them over bytes side by side.
void halve(const Source& from, const Target& to) {
  const auto take = to.channels == 1   ? take_every_other<1>
                    : to.channels == 3 ? take_every_other<3>
                                       : take_every_other<4>;
  const size_t channels = size_t(to.channels), count = (2 * size_t(to.width_px) - 1) * channels;
  std::vector<uint8_t> means(count + 1);
  for (int y = 0; y < to.height_px; ++y) {
    average_neighbours(row_of(from, 2 * y), row_of(from, 2 * y + 1), channels, count, means.data());
    take(means.data(), to.width_px, row_of(to, y));
  }
}

void shrink_by_whole_factors(const Source& from, const Target& to) {
  const auto average = to.channels == 1   ? average_columns<1>
                       : to.channels == 3 ? average_columns<3>
                                          : average_columns<4>;
  const int factor_x = from.width_px / to.width_px, factor_y = from.height_px / to.height_px;
  if (factor_x == 2 && factor_y == 2) return halve(from, to);
  std::vector<int> sums(size_t(from.width_px) * size_t(from.channels));
  for (int y = 0; y < to.height_px; ++y) {
    std::fill(sums.begin(), sums.end(), 0);
    for (int i = 0; i < factor_y; ++i) add_row(row_of(from, y * factor_y + i), sums.size(), sums.data());
    average(sums.data(), factor_x, factor_x * factor_y, to.width_px, row_of(to, y));
  }
}

// --- area otherwise: sums of floats, first along a row, then of rows
// ----------------------------------------------------

// The old pixels that each new one covers: whole ones between a first and a last of which it may cover a part.
struct AreaAxis {
  struct Tap {
    int from;
    float weight;
  };
  std::vector<Tap> taps;
  std::vector<size_t> begin;  // first tap of each new pixel, plus one entry for the end

  AreaAxis(int from_px, int to_px) {
    const double scale = pixels_per_pixel(from_px, to_px);
    constexpr double kNothing = 1e-3;  // smaller weights are left out
    for (int i = 0; i < to_px; ++i) {
      begin.push_back(taps.size());
      const double low = i * scale, high = low + scale;
      const double size = std::min(scale, from_px - low);
      const int last = std::min(int(std::floor(high)), from_px - 1), first = std::min(int(std::ceil(low)), last);
      if (first - low > kNothing) taps.push_back({first - 1, float((first - low) / size)});
      for (int whole = first; whole < last; ++whole) taps.push_back({whole, float(1.0 / size)});
      if (high - last > kNothing) taps.push_back({last, float(std::min(std::min(high - last, 1.0), size) / size)});
    }
    begin.push_back(taps.size());
  }
};

// `from` has a value more than the row has. `lanes` is a power of two, so that a pixel is one vector.
template <int channels>
void sum_columns(const float* from, const AreaAxis& axis, float* to) {
  constexpr int lanes = channels == 3 ? 4 : channels;
  const AreaAxis::Tap* tap = axis.taps.data();
  for (size_t i = 0; i + 1 < axis.begin.size(); ++i, to += channels) {
    float sum[lanes] = {};
    for (const AreaAxis::Tap* const end = axis.taps.data() + axis.begin[i + 1]; tap < end; ++tap) {
      const float* const pixel = from + tap->from * channels;
      const float weight = tap->weight;
      for (int c = 0; c < lanes; ++c) sum[c] += pixel[c] * weight;
    }
    for (int c = 0; c < channels; ++c) to[c] = sum[c];
  }
}

MAQ_SIMD_CLONES void add_weighted(const float* from, float weight, size_t count, float* sums) {
  for (size_t i = 0; i < count; ++i) sums[i] += from[i] * weight;
}

MAQ_SIMD_CLONES void round_row(const float* from, size_t count, uint8_t* to) {
  for (size_t i = 0; i < count; ++i) to[i] = rounded(from[i]);
}

void shrink_by_any_factors(const Source& from, const Target& to) {
  const auto sum = to.channels == 1 ? sum_columns<1> : to.channels == 3 ? sum_columns<3> : sum_columns<4>;
  const AreaAxis columns(from.width_px, to.width_px), rows(from.height_px, to.height_px);
  const size_t from_values = size_t(from.width_px) * size_t(from.channels);
  const size_t to_values = size_t(to.width_px) * size_t(to.channels);
  std::vector<float> line(from_values + 1), summed(to_values), sums(to_values);
  int summed_row = -1;
  for (int y = 0; y < to.height_px; ++y) {
    std::fill(sums.begin(), sums.end(), 0.0f);
    for (size_t i = rows.begin[size_t(y)]; i < rows.begin[size_t(y) + 1]; ++i) {
      const AreaAxis::Tap& tap = rows.taps[i];
      if (tap.from != summed_row) {
        to_floats(row_of(from, tap.from), from_values, line.data());
        sum(line.data(), columns, summed.data());
        summed_row = tap.from;
      }
      add_weighted(summed.data(), tap.weight, to_values, sums.data());
    }
    round_row(sums.data(), to_values, row_of(to, y));
  }
}

Source bgr_source(const ImageView& bgr) {
  return {bgr.planes[0].data, bgr.planes[0].stride_bytes, bgr.width_px, bgr.height_px, 3};
}

Target bgr_target(Frame& frame, int width_px, int height_px) {
  uint8_t* const pixels = frame.allocate_bgr(width_px, height_px);
  return {pixels, size_t(width_px) * 3, width_px, height_px, 3};
}

}  // namespace

void resize(const BytePicture<const uint8_t>& from, const BytePicture<uint8_t>& to) {
  if (to.width_px > from.width_px || to.height_px > from.height_px) return resize_bilinear(from, to);
  const double scale_x = pixels_per_pixel(from.width_px, to.width_px);
  const double scale_y = pixels_per_pixel(from.height_px, to.height_px);
  if (scale_x == std::nearbyint(scale_x) && scale_y == std::nearbyint(scale_y)) {
    shrink_by_whole_factors(from, to);
  } else {
    shrink_by_any_factors(from, to);
  }
}

void resize_to_bgr(const ImageView& from, int width_px, int height_px, Frame& to) {
  std::vector<uint8_t> memory;
  const ImageView bgr = as_bgr(from, memory);
  resize(bgr_source(bgr), bgr_target(to, width_px, height_px));
}

void shrink(const ImageView& image, int width_px, int height_px, Frame& frame) {
  if (image.format != MAQ_PIXEL_BGR8 || width_px < 1 || height_px < 1 || width_px > image.width_px ||
      height_px > image.height_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "An image of ", image.width_px, " x ", image.height_px, " pixels in ",
                pixel_format_name(image.format), " cannot be shrunk to ", width_px, " x ", height_px, " in BGR.");
  }
  resize(bgr_source(image), bgr_target(frame, width_px, height_px));
}

void shrink_valid(std::vector<uint8_t>& valid, int from_width_px, int from_height_px, int width_px, int height_px) {
  for (uint8_t& value : valid) value = value == 0 ? 0 : 255;
  std::vector<uint8_t> smaller(size_t(width_px) * size_t(height_px));
  resize({valid.data(), size_t(from_width_px), from_width_px, from_height_px, 1},
         {smaller.data(), size_t(width_px), width_px, height_px, 1});
  for (uint8_t& value : smaller) value = value == 255 ? 255 : 0;
  valid = std::move(smaller);
}

}  // namespace maq
