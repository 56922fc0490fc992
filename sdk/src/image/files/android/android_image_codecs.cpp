// image_codecs.h by Android itself.
#include "image/files/image_codecs.h"

#include "core/error.h"
#include "image/files/android/android_images.h"

namespace maq {
namespace {

constexpr int kJpegQuality = 95;

[[noreturn]] void refuse_depth() {
  throw Error(MAQ_ERROR_UNSUPPORTED, "This build has no codecs for files of depth; give depth as a frame.");
}

}  // namespace

DecodedImage decode_stored_image(const EncodedBytes& bytes, ImageFormat format) {
  if (format == ImageFormat::kTiff) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "TIFF images are not read on Android; save it as JPEG, PNG or WebP.");
  }
  const auto frame = std::make_shared<Frame>();
  if (AndroidImages::get().decode(bytes, MAQ_MAX_PIXELS, *frame) != JpegResult::kDecoded) return {};
  return {frame->image, frame};
}

std::vector<uint8_t> encode_stored_image(const std::string& extension, const ImageView& image) {
  const auto encoding = extension == ".png" ? AndroidImages::Encoding::kPng : AndroidImages::Encoding::kJpeg;
  std::vector<uint8_t> bytes;
  if (!AndroidImages::get().encode(image, encoding, kJpegQuality, bytes)) {
    throw Error(MAQ_ERROR_INTERNAL, "An image of ", image.width_px, " x ", image.height_px, " could not be encoded as ",
                extension, ": there may be too little memory.");
  }
  return bytes;
}

DecodedImage decode_depth_image(const EncodedBytes&, ImageFormat) { refuse_depth(); }
std::vector<uint8_t> encode_depth_image(const std::string&, const ImageView&) { refuse_depth(); }

}  // namespace maq
