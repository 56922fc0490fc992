// jpeg.h by Android itself.
#include "core/error.h"
#include "image/files/android/android_images.h"
#include "image/files/jpeg.h"

namespace maq {

JpegDecoder::~JpegDecoder() = default;

bool JpegDecoder::decode(const uint8_t* bytes, size_t size_bytes, int64_t max_pixels, Frame& frame) {
  const EncodedBytes encoded(bytes, size_bytes);
  if (recognise_format(encoded).format != ImageFormat::kJpeg) return false;
  return AndroidImages::get().decode(encoded, max_pixels, frame) == JpegResult::kDecoded;
}

JpegResult decode_jpeg_photo(const uint8_t* bytes, size_t size_bytes, Frame& frame) {
  const EncodedBytes encoded(bytes, size_bytes);
  const JpegResult result = AndroidImages::get().decode(encoded, MAQ_MAX_PIXELS, frame);
  return result == JpegResult::kDamaged && !has_jpeg_end(encoded) ? JpegResult::kTruncated : result;
}

JpegEncoder::~JpegEncoder() = default;

void JpegEncoder::encode(const ImageView& image, int quality, std::vector<uint8_t>& bytes) {
  if (AndroidImages::get().encode(image, AndroidImages::Encoding::kJpeg, quality, bytes)) return;
  throw Error(MAQ_ERROR_INTERNAL, "A frame could not be compressed as JPEG.");
}

}  // namespace maq
