// file_codecs.h by Android itself.
#include "core/error.h"
#include "image/files/android/android_images.h"
#include "image/files/file_codecs.h"

namespace maq {
namespace {

constexpr int kJpegQuality = 95;  // as OpenCV's

class AndroidFileCodecs : public FileCodecs {
 public:
  DecodedImage decode_image(const EncodedBytes& bytes, ImageFormat format) const override {
    if (format == ImageFormat::kTiff) {
      throw Error(MAQ_ERROR_UNSUPPORTED, "TIFF images are not read on Android; save it as JPEG, PNG or WebP.");
    }
    const auto frame = std::make_shared<Frame>();
    if (AndroidImages::get().decode(bytes, MAQ_MAX_PIXELS, *frame) != JpegResult::kDecoded) return {};
    return {frame->image, frame};
  }

  bool encode_image(const std::string& extension, const ImageView& image, std::vector<uint8_t>& bytes) const override {
    const auto encoding = extension == ".png" ? AndroidImages::Encoding::kPng : AndroidImages::Encoding::kJpeg;
    return AndroidImages::get().encode(image, encoding, kJpegQuality, bytes);
  }

  std::unique_ptr<ClipDecoder> open_clip(const std::string&) const override { fail_for_clips(); }

  std::unique_ptr<ClipEncoder> begin_clip(const std::string&, ClipFormat, double, int, int) const override {
    fail_for_clips();
  }

 private:
  [[noreturn]] static void fail_for_clips() {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "Video files are not read or written on Android. Decode or encode them with android.media.MediaCodec.");
  }
};

}  // namespace

const FileCodecs& file_codecs() {
  static const AndroidFileCodecs codecs;
  return codecs;
}

}  // namespace maq
