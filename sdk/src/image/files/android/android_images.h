// Image files by Android's own decoders and encoders (NDK: imagedecoder.h and bitmap.h, in libjnigraphics.so).
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "image/files/image_header.h"
#include "image/files/jpeg.h"

struct AImageDecoder;
struct AImageDecoderHeaderInfo;

namespace maq {

class AndroidImages {
 public:
  enum class Encoding { kJpeg = 0, kPng = 1 };  // as AndroidBitmapCompressFormat

  // Opens the library at the first call. Throws MAQ_ERROR_UNSUPPORTED before Android 11.
  static const AndroidImages& get();

  // A JPEG, PNG, WebP or BMP image of at most `max_pixels`, into `frame` as BGR8, as it is stored: not turned by its
  // EXIF orientation. Over the limits of frame.h: damaged. Throws std::bad_alloc.
  JpegResult decode(const EncodedBytes& encoded, int64_t max_pixels, Frame& frame) const;

  // Encodes any image; `quality` is 1 to 100, for JPEG. PNG has alpha where the image is RGBA8. False where Android
  // cannot.
  bool encode(const ImageView& image, Encoding encoding, int quality, std::vector<uint8_t>& bytes) const;

 private:
  // The fields of AndroidBitmapInfo.
  struct BitmapInfo {
    uint32_t width, height, stride;
    int32_t format;
    uint32_t flags;
  };
  using Writer = bool (*)(void* to, const void* data, size_t size);

  explicit AndroidImages(void* library);

  int (*create_from_buffer_)(const void*, size_t, AImageDecoder**);
  void (*delete_)(AImageDecoder*);
  const AImageDecoderHeaderInfo* (*get_header_info_)(const AImageDecoder*);
  int32_t (*get_width_)(const AImageDecoderHeaderInfo*);
  int32_t (*get_height_)(const AImageDecoderHeaderInfo*);
  int (*set_format_)(AImageDecoder*, int32_t);
  int (*set_unpremultiplied_)(AImageDecoder*, bool);
  int (*decode_image_)(AImageDecoder*, void*, size_t, size_t);
  int (*compress_)(const BitmapInfo*, int32_t, const void*, int32_t, int32_t, void*, Writer);
};

}  // namespace maq
