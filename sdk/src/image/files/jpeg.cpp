#include "image/files/jpeg.h"

#include <turbojpeg.h>

#include <algorithm>
#include <new>

#include "core/error.h"
#include "core/memory.h"
#include "image/convert.h"

namespace maq {

JpegDecoder::~JpegDecoder() {
  if (decoder_ != nullptr) tjDestroy(decoder_);
}

bool JpegDecoder::decode(const uint8_t* bytes, size_t size_bytes, int64_t max_pixels, Frame& frame) {
  if (decoder_ == nullptr) decoder_ = tjInitDecompress();
  if (decoder_ == nullptr) throw std::bad_alloc();
  if (decode_by_library(bytes, size_bytes, max_pixels, frame)) return true;
  const bool is_memory = says_out_of_memory(tjGetErrorStr2(decoder_));
  // After some truncated headers it decodes no other image.
  tjDestroy(decoder_);
  decoder_ = nullptr;
  if (is_memory) throw std::bad_alloc();
  return false;
}

bool JpegDecoder::decode_by_library(const uint8_t* bytes, size_t size_bytes, int64_t max_pixels, Frame& frame) {
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder_, bytes, size_bytes, &width, &height, &subsampling, &colours) != 0) return false;
  if (width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX) return false;
  if (int64_t(width) * height > std::min<int64_t>(max_pixels, MAQ_MAX_PIXELS)) return false;
  uint8_t* pixels = frame.allocate_bgr(width, height);
  // A truncated frame is only a warning to the library, which fills the rest with grey.
  return tjDecompress2(decoder_, bytes, size_bytes, pixels, width, width * 3, height, TJPF_BGR, TJFLAG_FASTDCT) == 0;
}

JpegEncoder::~JpegEncoder() {
  if (encoder_ != nullptr) tjDestroy(encoder_);
}

void JpegEncoder::encode(const ImageView& image, int quality, std::vector<uint8_t>& bytes) {
  if (encoder_ == nullptr) encoder_ = tjInitCompress();
  if (encoder_ == nullptr) throw std::bad_alloc();
  const ImageView bgr = as_bgr(image, bgr_);
  bytes.resize(tjBufSize(bgr.width_px, bgr.height_px, TJSAMP_420));
  uint8_t* target = bytes.data();
  unsigned long size_bytes = bytes.size();
  if (tjCompress2(encoder_, bgr.planes[0].data, bgr.width_px, int(bgr.planes[0].stride_bytes), bgr.height_px, TJPF_BGR,
                  &target, &size_bytes, TJSAMP_420, quality, TJFLAG_NOREALLOC) != 0) {
    if (says_out_of_memory(tjGetErrorStr2(encoder_))) throw std::bad_alloc();
    throw Error(MAQ_ERROR_INTERNAL, "A frame could not be compressed as JPEG.");
  }
  bytes.resize(size_bytes);
}

}  // namespace maq
