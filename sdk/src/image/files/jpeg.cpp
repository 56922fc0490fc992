#include "image/files/jpeg.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>

#include "core/error.h"
#include "image/convert.h"
#include "image/files/image_header.h"

namespace maq {
namespace {

using JpegSize = unsigned long;  // of the library's interface; 32 bits on Windows, more than any file that is read

}  // namespace

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
  if (tjDecompressHeader3(decoder_, bytes, JpegSize(size_bytes), &width, &height, &subsampling, &colours) != 0)
    return false;
  if (width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX) return false;
  if (int64_t(width) * height > std::min<int64_t>(max_pixels, MAQ_MAX_PIXELS)) return false;
  uint8_t* pixels = frame.allocate_bgr(width, height);
  // A truncated frame is only a warning to the library, which fills the rest with grey.
  return tjDecompress2(decoder_, bytes, JpegSize(size_bytes), pixels, width, width * 3, height, TJPF_BGR,
                       TJFLAG_FASTDCT) == 0;
}

namespace {

// Like OpenCV: K scales the values of Adobe's programs, the complements of C, M and Y.
void cmyk_to_bgr(const uint8_t* cmyk, size_t pixels, uint8_t* bgr) {
  for (size_t i = 0; i < pixels; ++i) {
    const int black = cmyk[4 * i + 3];
    for (size_t c = 0; c < 3; ++c) bgr[3 * i + c] = uint8_t(black - ((255 - cmyk[4 * i + 2 - c]) * black >> 8));
  }
}

// Returns whether an image that libjpeg decoded in part lacks its end. libjpeg reports only its first warning.
bool is_cut(tjhandle decoder, const uint8_t* bytes, size_t size_bytes) {
  return !has_jpeg_end({bytes, size_bytes}) || std::strstr(tjGetErrorStr2(decoder), "remature end") != nullptr;
}

}  // namespace

JpegResult decode_jpeg_photo(const uint8_t* bytes, size_t size_bytes, Frame& frame) {
  const std::unique_ptr<void, int (*)(tjhandle)> decoder(tjInitDecompress(), &tjDestroy);
  if (decoder == nullptr) throw std::bad_alloc();
  const auto failure = [&] {
    if (says_out_of_memory(tjGetErrorStr2(decoder.get()))) throw std::bad_alloc();
    return has_jpeg_end({bytes, size_bytes}) ? JpegResult::kDamaged : JpegResult::kTruncated;
  };
  int width = 0, height = 0, subsampling = 0, colours = -1;
  // The result is also an error for subsamplings without a name, which can be decoded.
  tjDecompressHeader3(decoder.get(), bytes, JpegSize(size_bytes), &width, &height, &subsampling, &colours);
  if (width < 1 || height < 1 || colours < 0) return failure();
  if (width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX || int64_t(width) * height > MAQ_MAX_PIXELS) {
    return JpegResult::kDamaged;
  }
  const bool is_cmyk = colours == TJCS_CMYK || colours == TJCS_YCCK;
  uint8_t* bgr = frame.allocate_bgr(width, height);
  std::vector<uint8_t> cmyk(is_cmyk ? size_t(width) * size_t(height) * 4 : 0);
  const int result = tjDecompress2(decoder.get(), bytes, JpegSize(size_bytes), is_cmyk ? cmyk.data() : bgr, width, 0,
                                   height, is_cmyk ? TJPF_CMYK : TJPF_BGR, TJFLAG_LIMITSCANS);
  if (result != 0 && tjGetErrorCode(decoder.get()) != TJERR_WARNING) return failure();
  if (result != 0 && is_cut(decoder.get(), bytes, size_bytes)) return JpegResult::kTruncated;
  if (is_cmyk) cmyk_to_bgr(cmyk.data(), size_t(width) * size_t(height), bgr);
  return JpegResult::kDecoded;
}

namespace {

// BGR8 or GREY8.
void compress(tjhandle encoder, const ImageView& image, int quality, int flags, std::vector<uint8_t>& bytes) {
  const bool is_grey = image.format == MAQ_PIXEL_GREY8;
  const int subsampling = is_grey ? TJSAMP_GRAY : TJSAMP_420;
  bytes.resize(tjBufSize(image.width_px, image.height_px, subsampling));
  uint8_t* target = bytes.data();
  JpegSize size_bytes = JpegSize(bytes.size());
  if (tjCompress2(encoder, image.planes[0].data, image.width_px, int(image.planes[0].stride_bytes), image.height_px,
                  is_grey ? TJPF_GRAY : TJPF_BGR, &target, &size_bytes, subsampling, quality,
                  flags | TJFLAG_NOREALLOC) != 0) {
    if (says_out_of_memory(tjGetErrorStr2(encoder))) throw std::bad_alloc();
    throw Error(MAQ_ERROR_INTERNAL, "An image could not be compressed as JPEG.");
  }
  bytes.resize(size_bytes);
}

}  // namespace

JpegEncoder::~JpegEncoder() {
  if (encoder_ != nullptr) tjDestroy(encoder_);
}

void JpegEncoder::encode(const ImageView& image, int quality, std::vector<uint8_t>& bytes) {
  if (encoder_ == nullptr) encoder_ = tjInitCompress();
  if (encoder_ == nullptr) throw std::bad_alloc();
  compress(encoder_, as_bgr(image, bgr_), quality, 0, bytes);
}

std::vector<uint8_t> encode_jpeg_photo(const ImageView& image) {
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), &tjDestroy);
  if (encoder == nullptr) throw std::bad_alloc();
  std::vector<uint8_t> bytes;
  compress(encoder.get(), image, 95, TJFLAG_ACCURATEDCT, bytes);
  return bytes;
}

}  // namespace maq
