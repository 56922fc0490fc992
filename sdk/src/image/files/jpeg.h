// JPEG images, as cameras send them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/frame.h"

namespace maq {

class JpegDecoder {
 public:
  JpegDecoder() = default;
  ~JpegDecoder();
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  // Into `frame`, as BGR8. False for what is damaged, truncated, over the limits of frame.h, or of more than
  // `max_pixels`. Throws std::bad_alloc.
  bool decode(const uint8_t* bytes, size_t size_bytes, int64_t max_pixels, Frame& frame);

 private:
  bool decode_by_library(const uint8_t* bytes, size_t size_bytes, int64_t max_pixels, Frame& frame);

  void* decoder_ = nullptr;
};

class JpegEncoder {
 public:
  JpegEncoder() = default;
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  // Into `bytes`, at `quality` 1 to 100, with colour at half the resolution. Throws MAQ_ERROR_INTERNAL.
  void encode(const ImageView& image, int quality, std::vector<uint8_t>& bytes);

 private:
  void* encoder_ = nullptr;
  std::vector<uint8_t> bgr_;
};

}  // namespace maq
