// Android's libjnigraphics.so by OpenCV: the functions of the NDK's imagedecoder.h and bitmap.h that the SDK looks up,
// with Android's habit of rotating images upright by their EXIF orientation. With MAQ_OLDER_ANDROID it has none of
// them.
#include <cstdint>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#define EXPORTED extern "C" __attribute__((visibility("default")))

#ifdef MAQ_OLDER_ANDROID

EXPORTED int AndroidBitmap_getInfo() { return 0; }

#else

struct AImageDecoder {
  cv::Mat rgba;
  bool is_rgba8888 = false, is_unpremultiplied = false;
};
struct BitmapInfo {
  uint32_t width, height, stride;
  int32_t format;
  uint32_t flags;
};

// Results of the next calls instead of success; 0: real results.
extern "C" {
__attribute__((visibility("default"))) int fake_create_result = 0, fake_decode_result = 0, fake_compress_result = 0;
__attribute__((visibility("default"))) int fake_decoders_alive = 0;
}

EXPORTED int AImageDecoder_createFromBuffer(const void* bytes, size_t size, AImageDecoder** decoder) {
  if (fake_create_result != 0) return fake_create_result;
  const cv::Mat encoded(1, int(size), CV_8UC1, const_cast<void*>(bytes));
  const bool is_png = size > 4 && std::memcmp(bytes, "\x89PNG", 4) == 0;
  cv::Mat image;
  try {
    image = cv::imdecode(encoded, is_png ? cv::IMREAD_UNCHANGED : cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
  }
  if (image.empty()) return -6;
  cv::Mat rgba(image.size(), CV_8UC4, cv::Scalar::all(255));
  if (image.channels() == 1) {
    cv::mixChannels({image}, {rgba}, {0, 0, 0, 1, 0, 2});
  } else if (image.channels() == 3) {
    cv::mixChannels({image}, {rgba}, {0, 2, 1, 1, 2, 0});
  } else {
    cv::mixChannels({image}, {rgba}, {0, 2, 1, 1, 2, 0, 3, 3});
  }
  *decoder = new AImageDecoder{rgba};
  ++fake_decoders_alive;
  return 0;
}
EXPORTED void AImageDecoder_delete(AImageDecoder* decoder) {
  delete decoder;
  --fake_decoders_alive;
}
EXPORTED const AImageDecoder* AImageDecoder_getHeaderInfo(const AImageDecoder* decoder) { return decoder; }
EXPORTED int32_t AImageDecoderHeaderInfo_getWidth(const AImageDecoder* decoder) { return decoder->rgba.cols; }
EXPORTED int32_t AImageDecoderHeaderInfo_getHeight(const AImageDecoder* decoder) { return decoder->rgba.rows; }
EXPORTED int AImageDecoder_setAndroidBitmapFormat(AImageDecoder* decoder, int32_t format) {
  decoder->is_rgba8888 = format == 1;
  return decoder->is_rgba8888 ? 0 : -5;
}
EXPORTED int AImageDecoder_setUnpremultipliedRequired(AImageDecoder* decoder, bool required) {
  decoder->is_unpremultiplied = required;
  return 0;
}
EXPORTED int AImageDecoder_decodeImage(AImageDecoder* decoder, void* pixels, size_t stride, size_t size) {
  const cv::Mat& rgba = decoder->rgba;
  if (fake_decode_result != 0) return fake_decode_result;
  if (!decoder->is_rgba8888 || !decoder->is_unpremultiplied) return -5;
  if (stride < size_t(rgba.cols) * 4 || size < stride * size_t(rgba.rows)) return -5;
  rgba.copyTo(cv::Mat(rgba.rows, rgba.cols, CV_8UC4, pixels, stride));
  return 0;
}
EXPORTED int AndroidBitmap_compress(const BitmapInfo* info, int32_t dataspace, const void* pixels, int32_t format,
                                    int32_t quality, void* to, bool (*write)(void*, const void*, size_t)) {
  if (fake_compress_result != 0) return fake_compress_result;
  if (info->format != 1 || dataspace != 142671872 || (format != 0 && format != 1)) return -1;
  const cv::Mat rgba(int(info->height), int(info->width), CV_8UC4, const_cast<void*>(pixels), info->stride);
  const bool has_alpha = info->flags == 2 && format == 1;
  cv::Mat image(rgba.size(), has_alpha ? CV_8UC4 : CV_8UC3);
  cv::mixChannels({rgba}, {image},
                  has_alpha ? std::vector<int>{0, 2, 1, 1, 2, 0, 3, 3} : std::vector<int>{0, 2, 1, 1, 2, 0});
  std::vector<uint8_t> bytes;
  if (!cv::imencode(format == 0 ? ".jpg" : ".png", image, bytes,
                    format == 0 ? std::vector<int>{cv::IMWRITE_JPEG_QUALITY, quality} : std::vector<int>{})) {
    return -1;
  }
  // In two pieces, as Android may.
  const size_t half = bytes.size() / 2;
  return write(to, bytes.data(), half) && write(to, bytes.data() + half, bytes.size() - half) ? 0 : -3;
}

#endif
