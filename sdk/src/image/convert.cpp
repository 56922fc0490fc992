#include "image/convert.h"

#include <algorithm>
#include <cstring>

#include "core/error.h"
#include "core/simd_clones.h"

namespace maq {
namespace {

// --- YUV: BT.601 in video range, coefficients of 20 fractional bits
// ----------------------------------------------------

constexpr int kYuvBits = 20;
constexpr int kLuma = 1220542;      // 1.164
constexpr int kRedOfV = 1673527;    // 1.596
constexpr int kGreenOfV = -852492;  // -0.813
constexpr int kGreenOfU = -409993;  // -0.391
constexpr int kBlueOfU = 2116026;   // 2.018

constexpr int kBlockPx = 128;  // even; the work of a block stays in the first cache

// The contribution of a block's chroma to each of its pixels, with the half for rounding.
struct ChromaTerms {
  int blue[kBlockPx], green[kBlockPx], red[kBlockPx];
};

// `chroma`: U, V of each pair of pixels.
inline void make_chroma_terms(const uint8_t* chroma, int pairs, ChromaTerms& terms) {
  constexpr int kHalf = 1 << (kYuvBits - 1);
  for (int i = 0; i < pairs; ++i) {
    const int u = chroma[2 * i] - 128, v = chroma[2 * i + 1] - 128;
    terms.blue[2 * i] = terms.blue[2 * i + 1] = kHalf + kBlueOfU * u;
    terms.green[2 * i] = terms.green[2 * i + 1] = kHalf + kGreenOfV * v + kGreenOfU * u;
    terms.red[2 * i] = terms.red[2 * i + 1] = kHalf + kRedOfV * v;
  }
}

// Clamped as 16 bits, twice as many in a vector as the sums.
inline void add_luma(const uint8_t* luma, int count, const ChromaTerms& terms, uint8_t* bgr) {
  int16_t blue[kBlockPx], green[kBlockPx], red[kBlockPx];
  for (int i = 0; i < count; ++i) {
    const int y = std::max(luma[i] - 16, 0) * kLuma;
    blue[i] = int16_t((y + terms.blue[i]) >> kYuvBits);
    green[i] = int16_t((y + terms.green[i]) >> kYuvBits);
    red[i] = int16_t((y + terms.red[i]) >> kYuvBits);
  }
  const auto to_byte = [](int16_t value) { return uint8_t(std::clamp<int16_t>(value, 0, 255)); };
  for (int i = 0; i < count; ++i) {
    bgr[3 * i] = to_byte(blue[i]);
    bgr[3 * i + 1] = to_byte(green[i]);
    bgr[3 * i + 2] = to_byte(red[i]);
  }
}

// One or two rows of pixels that share a row of chroma.
inline void yuv_to_bgr(const uint8_t* const* luma_rows, const uint8_t* chroma, int rows, int width, uint8_t* bgr,
                       size_t bgr_stride) {
  for (int x = 0; x < width; x += kBlockPx) {
    const int count = std::min(kBlockPx, width - x);
    ChromaTerms terms;
    make_chroma_terms(chroma + x, (count + 1) / 2, terms);
    for (int row = 0; row < rows; ++row) {
      add_luma(luma_rows[row] + x, count, terms, bgr + size_t(row) * bgr_stride + 3 * size_t(x));
    }
  }
}

MAQ_SIMD_CLONES void yuv_rows_to_bgr(const uint8_t* const* luma_rows, const uint8_t* chroma, int rows, int width,
                                     uint8_t* bgr, size_t bgr_stride) {
  yuv_to_bgr(luma_rows, chroma, rows, width, bgr, bgr_stride);
}

MAQ_SIMD_CLONES void yuyv_row_to_bgr(const uint8_t* yuyv, int width, uint8_t* bgr) {
  uint8_t luma[kBlockPx], chroma[kBlockPx];
  for (int x = 0; x < width; x += kBlockPx, yuyv += 2 * kBlockPx, bgr += 3 * kBlockPx) {
    const int count = std::min(kBlockPx, width - x);
    for (int i = 0; i < (count + 1) / 2 * 2; ++i) {
      luma[i] = yuyv[2 * i];
      chroma[i] = yuyv[2 * i + 1];
    }
    const uint8_t* const luma_rows[] = {luma};
    yuv_to_bgr(luma_rows, chroma, 1, count, bgr, 0);
  }
}

void nv12_to_bgr(const ImageView& image, uint8_t* bgr) {
  const size_t bgr_stride = size_t(image.width_px) * 3;
  for (int y = 0; y < image.height_px; y += 2) {
    const uint8_t* const luma = image.planes[0].data + size_t(y) * image.planes[0].stride_bytes;
    const uint8_t* const luma_rows[] = {luma, luma + image.planes[0].stride_bytes};
    yuv_rows_to_bgr(luma_rows, image.planes[1].data + size_t(y / 2) * image.planes[1].stride_bytes,
                    std::min(2, image.height_px - y), image.width_px, bgr + size_t(y) * bgr_stride, bgr_stride);
  }
}

// --- packed formats, row by row
// ---------------------------------------------------------------------------------------

// RGB to BGR and back. Five pixels are a vector; the next vector overwrites its last byte.
MAQ_SIMD_CLONES void swap_red_and_blue(const uint8_t* from, int width, uint8_t* to) {
  using Bytes __attribute__((vector_size(16))) = uint8_t;
  int i = 0;
  for (; i + 6 <= width; i += 5) {
    Bytes pixels;
    std::memcpy(&pixels, from + 3 * i, sizeof pixels);
    pixels = __builtin_shufflevector(pixels, pixels, 2, 1, 0, 5, 4, 3, 8, 7, 6, 11, 10, 9, 14, 13, 12, 15);
    std::memcpy(to + 3 * i, &pixels, sizeof pixels);
  }
  for (; i < width; ++i) {
    to[3 * i] = from[3 * i + 2];
    to[3 * i + 1] = from[3 * i + 1];
    to[3 * i + 2] = from[3 * i];
  }
}

MAQ_SIMD_CLONES void rgba_to_bgr(const uint8_t* rgba, int width, uint8_t* bgr) {
  for (int i = 0; i < width; ++i) {
    bgr[3 * i] = rgba[4 * i + 2];
    bgr[3 * i + 1] = rgba[4 * i + 1];
    bgr[3 * i + 2] = rgba[4 * i];
  }
}

// Four bytes at once: compilers make no good vectors of pixels that grow.
void bgr_to_rgba(const uint8_t* bgr, int width, uint8_t* rgba) {
  const auto put = [&](uint32_t blue_first) {
    const uint32_t red_first = __builtin_bswap32(blue_first) >> 8 | 0xff000000;
    std::memcpy(rgba, &red_first, 4);
  };
  uint32_t pixel = 0;
  for (int i = 0; i + 1 < width; ++i, bgr += 3, rgba += 4) {
    std::memcpy(&pixel, bgr, 4);  // and a byte of the next one
    put(pixel);
  }
  std::memcpy(&pixel, bgr, 3);
  put(pixel);
}

MAQ_SIMD_CLONES void grey_to_bgr(const uint8_t* grey, int width, uint8_t* bgr) {
  for (int i = 0; i < width; ++i) bgr[3 * i] = bgr[3 * i + 1] = bgr[3 * i + 2] = grey[i];
}

// BT.601's weights, of 15 fractional bits.
MAQ_SIMD_CLONES void bgr_to_grey(const uint8_t* bgr, int width, uint8_t* grey) {
  for (int i = 0; i < width; ++i) {
    grey[i] = uint8_t((bgr[3 * i] * 3735 + bgr[3 * i + 1] * 19235 + bgr[3 * i + 2] * 9798 + (1 << 14)) >> 15);
  }
}

void copy_bgr(const uint8_t* from, int width, uint8_t* to) { std::memcpy(to, from, 3 * size_t(width)); }

using ConvertRow = void (*)(const uint8_t* from, int width, uint8_t* to);

void convert_rows(const ImageView& image, ConvertRow convert, uint8_t* to, size_t to_stride) {
  for (int y = 0; y < image.height_px; ++y) {
    convert(image.planes[0].data + size_t(y) * image.planes[0].stride_bytes, image.width_px,
            to + size_t(y) * to_stride);
  }
}

// From a format other than BGR8; null for formats without rows of colour pixels.
ConvertRow row_to_bgr(maq_pixel_format format) {
  switch (format) {
    case MAQ_PIXEL_RGB8: return swap_red_and_blue;
    case MAQ_PIXEL_RGBA8: return rgba_to_bgr;
    case MAQ_PIXEL_GREY8: return grey_to_bgr;
    case MAQ_PIXEL_YUYV: return yuyv_row_to_bgr;
    default: return nullptr;
  }
}

ConvertRow row_from_bgr(maq_pixel_format format) {
  switch (format) {
    case MAQ_PIXEL_RGB8: return swap_red_and_blue;
    case MAQ_PIXEL_RGBA8: return bgr_to_rgba;
    case MAQ_PIXEL_GREY8: return bgr_to_grey;
    default: return copy_bgr;
  }
}

}  // namespace

ImageView as_bgr(const ImageView& image, std::vector<uint8_t>& memory) {
  if (image.format == MAQ_PIXEL_BGR8) return image;
  const ConvertRow convert = row_to_bgr(image.format);
  if (convert == nullptr && image.format != MAQ_PIXEL_NV12) {
    if (is_depth(image.format)) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "A depth image has no colours; use the colour image.");
    }
    throw Error(MAQ_ERROR_UNSUPPORTED, "Pixel format ", int(image.format), " is not known.");
  }
  const size_t stride = size_t(image.width_px) * 3;
  memory.resize(stride * size_t(image.height_px));
  if (convert == nullptr) {
    nv12_to_bgr(image, memory.data());
  } else {
    convert_rows(image, convert, memory.data(), stride);
  }
  return {MAQ_PIXEL_BGR8, image.width_px, image.height_px, {{memory.data(), stride}, {}}};
}

size_t checked_stride(maq_pixel_format format, int width_px, int height_px, size_t stride_bytes, size_t size_bytes) {
  const size_t shortest = row_bytes(format, 0, width_px);
  const size_t stride = stride_bytes == 0 ? shortest : stride_bytes;
  if (stride < shortest) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "stride_bytes is ", stride, ", but a row of ", width_px, " pixels in ",
                pixel_format_name(format), " takes ", shortest, " bytes.");
  }
  const std::optional<size_t> needed = bytes_of_rows(stride, height_px, shortest);
  if (!needed) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "stride_bytes is ", stride, ", but ", height_px,
                " rows that far apart fit into no memory; a row takes ", shortest, " bytes.");
  }
  if (size_bytes < *needed) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "size_bytes is ", size_bytes, ", but ", width_px, " x ", height_px,
                " pixels in ", pixel_format_name(format), " take ", *needed, " bytes.");
  }
  return stride;
}

void copy_pixels(const ImageView& image, maq_pixel_format format, uint8_t* pixels, size_t stride_bytes,
                 size_t size_bytes) {
  if (format < MAQ_PIXEL_RGB8 || format > MAQ_PIXEL_GREY8) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "Pixels cannot be copied as ", pixel_format_name(format),
                "; ask for RGB8, BGR8, RGBA8 or GREY8.");
  }
  const size_t stride = checked_stride(format, image.width_px, image.height_px, stride_bytes, size_bytes);
  std::vector<uint8_t> memory;
  convert_rows(as_bgr(image, memory), row_from_bgr(format), pixels, stride);
}

}  // namespace maq
