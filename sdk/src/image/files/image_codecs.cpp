#include "image/files/image_codecs.h"

#include "image/files/bmp.h"
#include "image/files/jpeg.h"
#include "image/files/png.h"
#include "image/files/tiff.h"
#include "image/files/webp.h"

namespace maq {

DecodedImage decode_stored_image(const EncodedBytes& bytes, ImageFormat format) {
  switch (format) {
    case ImageFormat::kPng: return decode_png(bytes);
    case ImageFormat::kWebp: return decode_webp(bytes);
    case ImageFormat::kBmp: return decode_bmp(bytes);
    case ImageFormat::kTiff: return decode_tiff(bytes);
    default: return {};
  }
}

std::vector<uint8_t> encode_stored_image(const std::string& extension, const ImageView& image) {
  if (extension == ".png") return encode_png(image);
  return encode_jpeg_photo(image);
}

DecodedImage decode_depth_image(const EncodedBytes& bytes, ImageFormat format) {
  return format == ImageFormat::kPng ? decode_depth_png(bytes) : decode_depth_tiff(bytes);
}

std::vector<uint8_t> encode_depth_image(const std::string& extension, const ImageView& image) {
  return extension == ".png" ? encode_png(image) : encode_depth_tiff(image);
}

}  // namespace maq
