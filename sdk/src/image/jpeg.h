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

  // Into `frame`, as BGR8. False for what is damaged, cut short, over the limits of frame.h, or of another size than
  // `width_px` x `height_px`, unless these are 0.
  bool decode(const uint8_t* bytes, size_t size_bytes, int width_px, int height_px, Frame& frame);

 private:
  bool decode_by_library(const uint8_t* bytes, size_t size_bytes, int width_px, int height_px, Frame& frame);

  void* decoder_ = nullptr;
};

}  // namespace maq
