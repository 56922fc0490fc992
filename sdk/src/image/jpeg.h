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

  // Into `frame`, as BGR8. False for what is damaged, cut short, or over the limits of frame.h.
  bool decode(const uint8_t* bytes, size_t size_bytes, Frame& frame);

 private:
  void* decoder_ = nullptr;
};

}  // namespace maq
