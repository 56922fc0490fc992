#include "image/jpeg.h"

#include <turbojpeg.h>

#include "core/error.h"
#include "image/opencv_view.h"

namespace maq {

JpegDecoder::~JpegDecoder() {
  if (decoder_ != nullptr) tjDestroy(decoder_);
}

bool JpegDecoder::decode(const uint8_t* bytes, size_t size_bytes, Frame& frame) {
  if (decoder_ == nullptr) decoder_ = tjInitDecompress();
  if (decoder_ == nullptr) return false;
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder_, bytes, size_bytes, &width, &height, &subsampling, &colours) != 0) return false;
  if (width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX) return false;
  if (int64_t(width) * height > MAQ_MAX_PIXELS) return false;
  uint8_t* pixels = frame.allocate_bgr(width, height);
  // A frame that was cut short is only a warning to the library, which fills the rest with grey.
  return tjDecompress2(decoder_, bytes, size_bytes, pixels, width, width * 3, height, TJPF_BGR, TJFLAG_FASTDCT) == 0;
}

JpegEncoder::~JpegEncoder() {
  if (encoder_ != nullptr) tjDestroy(encoder_);
}

void JpegEncoder::encode(const ImageView& image, int quality, std::vector<uint8_t>& bytes) {
  if (encoder_ == nullptr) encoder_ = tjInitCompress();
  const cv::Mat bgr = as_bgr(image, bgr_);
  bytes.resize(tjBufSize(bgr.cols, bgr.rows, TJSAMP_420));
  uint8_t* target = bytes.data();
  unsigned long size_bytes = bytes.size();
  if (encoder_ == nullptr || tjCompress2(encoder_, bgr.data, bgr.cols, int(bgr.step), bgr.rows, TJPF_BGR, &target,
                                         &size_bytes, TJSAMP_420, quality, TJFLAG_NOREALLOC) != 0) {
    throw Error(MAQ_ERROR_INTERNAL, "A frame could not be compressed as JPEG.");
  }
  bytes.resize(size_bytes);
}

}  // namespace maq
