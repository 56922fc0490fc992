// JPEG images: images from cameras, and photos. By libjpeg-turbo (jpeg.cpp) or by Android (android/).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

class JpegDecoder {
 public:
  JpegDecoder() = default;
  ~JpegDecoder();  // NOLINT(performance-trivially-destructible): on Android it holds nothing
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  // Into `frame`, as BGR8. Returns false for an image that is damaged, truncated, over the limits of frame.h, or of
  // more than `max_pixels`. Throws std::bad_alloc.
  bool decode(const uint8_t* bytes, size_t size_bytes, int64_t max_pixels, Frame& frame);

 private:
  bool decode_by_library(const uint8_t* bytes, size_t size_bytes, int64_t max_pixels, Frame& frame);

  [[maybe_unused]] void* decoder_ = nullptr;
};

enum class JpegResult { kDecoded, kTruncated, kDamaged };

// Decodes a photo of any colour space to BGR8 at full accuracy, bit-identical to OpenCV. Warnings of libjpeg, such as
// bytes between segments, are ignored. Truncated images are refused; images over the limits of frame.h are damaged.
JpegResult decode_jpeg_photo(const uint8_t* bytes, size_t size_bytes, Frame& frame);

// Encodes BGR8 or GREY8 at quality 95, colour at half the resolution, bit-identical to OpenCV. Throws
// MAQ_ERROR_INTERNAL and std::bad_alloc.
std::vector<uint8_t> encode_jpeg_photo(const ImageView& image);

class JpegEncoder {
 public:
  JpegEncoder() = default;
  ~JpegEncoder();  // NOLINT(performance-trivially-destructible)
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  // Into `bytes`, at `quality` 1 to 100, with colour at half the resolution. Throws MAQ_ERROR_INTERNAL.
  void encode(const ImageView& image, int quality, std::vector<uint8_t>& bytes);

 private:
  [[maybe_unused]] void* encoder_ = nullptr;
  [[maybe_unused]] std::vector<uint8_t> bgr_;
};

}  // namespace maq
