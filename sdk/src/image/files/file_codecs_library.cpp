#include "core/memory.h"
#include "core/module.h"
#include "image/files/file_codecs.h"

namespace maq {
namespace {

// Codecs fail without memory as they fail for damaged files. Memory is therefore checked after each failure; if it was
// short only for a moment, the call is repeated.
class MemoryCheckedCodecs : public FileCodecs {
 public:
  explicit MemoryCheckedCodecs(const FileCodecs& codecs) : codecs_(codecs) {}

  DecodedImage decode_image(const EncodedBytes& bytes, ImageFormat format) const override {
    DecodedImage image = codecs_.decode_image(bytes, format);
    if (image.view.width_px > 0) return image;
    require_memory(kCodecBytes + kPixelsOfAByte * bytes.size);
    return codecs_.decode_image(bytes, format);
  }

  bool encode_image(const std::string& extension, const ImageView& image, std::vector<uint8_t>& bytes) const override {
    if (codecs_.encode_image(extension, image, bytes)) return true;
    require_memory(kCodecBytes + kBytesOfAPixel * size_t(image.width_px) * size_t(image.height_px));
    return codecs_.encode_image(extension, image, bytes);
  }

  DecodedImage decode_depth(const EncodedBytes& bytes, ImageFormat format) const override {
    DecodedImage image = codecs_.decode_depth(bytes, format);
    if (image.view.width_px > 0) return image;
    require_memory(kCodecBytes + kPixelsOfAByte * bytes.size);
    return codecs_.decode_depth(bytes, format);
  }

  bool encode_depth(const std::string& extension, const ImageView& image, std::vector<uint8_t>& bytes) const override {
    if (codecs_.encode_depth(extension, image, bytes)) return true;
    require_memory(kCodecBytes + kBytesOfAPixel * size_t(image.width_px) * size_t(image.height_px));
    return codecs_.encode_depth(extension, image, bytes);
  }

  std::unique_ptr<ClipDecoder> open_clip(const std::string& path) const override {
    if (auto clip = codecs_.open_clip(path)) return clip;
    require_memory(kCodecBytes);
    return codecs_.open_clip(path);
  }

  std::unique_ptr<ClipEncoder> begin_clip(const std::string& path, ClipFormat format, double fps, int width_px,
                                          int height_px) const override {
    if (auto clip = codecs_.begin_clip(path, format, fps, width_px, height_px)) return clip;
    require_memory(kCodecBytes + kBytesOfAPixel * size_t(width_px) * size_t(height_px));
    return codecs_.begin_clip(path, format, fps, width_px, height_px);
  }

 private:
  // More than codecs take: themselves, for each byte of an image file, for each pixel of an image.
  static constexpr size_t kCodecBytes = size_t(64) << 20, kPixelsOfAByte = 16, kBytesOfAPixel = 16;

  const FileCodecs& codecs_;
};

}  // namespace

const FileCodecs& file_codecs() {
  // Tried again when it throws.
  static const auto* const codecs = new MemoryCheckedCodecs(*static_cast<const FileCodecs*>(
      open_module("libmaquette_files.so", kFileCodecsSymbol, "Image and video files need",
                  "Install it and OpenCV's imgcodecs and videoio beside libmaquette.so.")));
  return *codecs;
}

}  // namespace maq
