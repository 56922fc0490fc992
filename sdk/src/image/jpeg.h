// JPEG images as cameras send them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/frame.h"

namespace maq {

class JpegDecoder {
 public:
  JpegDecoder() = default;
  ~JpegDecoder();
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  // Into `frame`, as BGR8. False for what is damaged, cut short, over the limits of frame.h, or of more than `most_pixels`.
  bool decode(const uint8_t* bytes, size_t size_bytes, int64_t most_pixels, Frame& frame);

 private:
  bool decode_by_library(const uint8_t* bytes, size_t size_bytes, int64_t most_pixels, Frame& frame);

  void* decoder_ = nullptr;
};

}  // namespace maq
