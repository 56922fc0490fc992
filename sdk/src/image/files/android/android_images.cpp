#include "image/files/android/android_images.h"

#include <dlfcn.h>

#include <algorithm>
#include <memory>
#include <new>

#include "core/error.h"
#include "core/module.h"
#include "image/convert.h"

namespace maq {
namespace {

// Values of the NDK's headers.
constexpr int kSuccess = 0, kIncomplete = -1, kInternalError = -8;  // ANDROID_IMAGE_DECODER_*
constexpr int kAllocationFailed = -3;                               // ANDROID_BITMAP_RESULT_*
constexpr int32_t kRgba8888 = 1;                                    // ANDROID_BITMAP_FORMAT_*
constexpr uint32_t kOpaque = 1, kUnpremultiplied = 2;               // ANDROID_BITMAP_FLAGS_ALPHA_*
constexpr int32_t kSrgb = 142671872;                                // ADATASPACE_*

template <class Function>
void find(void* library, const char* name, Function& function) {
  function = reinterpret_cast<Function>(library == nullptr ? nullptr : dlsym(library, name));
  if (function != nullptr) return;
  throw Error(
      MAQ_ERROR_UNSUPPORTED,
      "Image files need Android 11 (API level 30) or newer. Decode the image with android.graphics.BitmapFactory "
      "and give its pixels to the SDK.");
}

}  // namespace

AndroidImages::AndroidImages(void* library) {
  find(library, "AImageDecoder_createFromBuffer", create_from_buffer_);
  find(library, "AImageDecoder_delete", delete_);
  find(library, "AImageDecoder_getHeaderInfo", get_header_info_);
  find(library, "AImageDecoderHeaderInfo_getWidth", get_width_);
  find(library, "AImageDecoderHeaderInfo_getHeight", get_height_);
  find(library, "AImageDecoder_setAndroidBitmapFormat", set_format_);
  find(library, "AImageDecoder_setUnpremultipliedRequired", set_unpremultiplied_);
  find(library, "AImageDecoder_decodeImage", decode_image_);
  find(library, "AndroidBitmap_compress", compress_);
}

const AndroidImages& AndroidImages::get() {
  static const AndroidImages images(open_library("libjnigraphics.so").library);  // tried again when it throws
  return images;
}

JpegResult AndroidImages::decode(const EncodedBytes& encoded, int64_t max_pixels, Frame& frame) const {
  // Android rotates images upright, and no option prevents it. A copy without the EXIF orientation is decoded.
  std::vector<uint8_t> without_orientation;
  EncodedBytes bytes = encoded;
  if (const auto place = find_exif_orientation(encoded)) {
    without_orientation.assign(encoded.data, encoded.data + encoded.size);
    without_orientation[place->offset] = place->is_little_endian ? 1 : 0;
    without_orientation[place->offset + 1] = place->is_little_endian ? 0 : 1;
    bytes = without_orientation;
  }
  const auto failure = [](int result) {
    if (result == kInternalError) throw std::bad_alloc();
    return result == kIncomplete ? JpegResult::kTruncated : JpegResult::kDamaged;
  };

  AImageDecoder* created = nullptr;
  if (const int result = create_from_buffer_(bytes.data, bytes.size, &created)) return failure(result);
  const std::unique_ptr<AImageDecoder, void (*)(AImageDecoder*)> decoder(created, delete_);
  const AImageDecoderHeaderInfo* header = get_header_info_(created);
  const int width = get_width_(header), height = get_height_(header);
  if (width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX) return JpegResult::kDamaged;
  if (int64_t(width) * height > std::min<int64_t>(max_pixels, MAQ_MAX_PIXELS)) return JpegResult::kDamaged;
  if (set_format_(created, kRgba8888) != kSuccess) return JpegResult::kDamaged;
  if (set_unpremultiplied_(created, true) != kSuccess) return JpegResult::kDamaged;

  const size_t stride = size_t(width) * 4;
  std::vector<uint8_t> rgba(stride * size_t(height));
  if (const int result = decode_image_(created, rgba.data(), stride, rgba.size())) return failure(result);
  uint8_t* pixels = frame.allocate_bgr(width, height);
  copy_pixels(packed_view(MAQ_PIXEL_RGBA8, width, height, rgba.data()), MAQ_PIXEL_BGR8, pixels, 0,
              frame.storage.size());
  return JpegResult::kDecoded;
}

bool AndroidImages::encode(const ImageView& image, Encoding encoding, int quality, std::vector<uint8_t>& bytes) const {
  std::vector<uint8_t> rgba(packed_bytes(MAQ_PIXEL_RGBA8, image.width_px, image.height_px));
  const bool has_alpha = image.format == MAQ_PIXEL_RGBA8 && encoding == Encoding::kPng;
  if (has_alpha) {
    copy_packed(image, rgba.data());
  } else {
    copy_pixels(image, MAQ_PIXEL_RGBA8, rgba.data(), 0, rgba.size());
  }
  const BitmapInfo info{uint32_t(image.width_px), uint32_t(image.height_px), uint32_t(image.width_px) * 4, kRgba8888,
                        has_alpha ? kUnpremultiplied : kOpaque};
  bytes.clear();
  const Writer append = [](void* to, const void* data, size_t size) {
    try {
      const auto* first = static_cast<const uint8_t*>(data);
      static_cast<std::vector<uint8_t>*>(to)->insert(static_cast<std::vector<uint8_t>*>(to)->end(), first,
                                                     first + size);
      return true;
    } catch (const std::bad_alloc&) {
      return false;
    }
  };
  const int result = compress_(&info, kSrgb, rgba.data(), int32_t(encoding), quality, &bytes, append);
  if (result == kAllocationFailed) throw std::bad_alloc();
  return result == kSuccess;
}

}  // namespace maq
