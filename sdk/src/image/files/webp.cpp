#include "image/files/webp.h"

#include <webp/decode.h>

#include <new>

namespace maq {

DecodedImage decode_webp(const EncodedBytes& bytes) {
  WebPDecoderConfig config;
  if (WebPInitDecoderConfig(&config) == 0) return {};
  if (WebPGetFeatures(bytes.data, bytes.size, &config.input) != VP8_STATUS_OK) return {};
  const int64_t width = config.input.width, height = config.input.height;
  if (width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX) return {};
  if (width * height > MAQ_MAX_PIXELS || config.input.has_animation != 0) return {};
  NewImage image(MAQ_PIXEL_BGR8, int(width), int(height));
  config.output.colorspace = MODE_BGR;
  config.output.is_external_memory = 1;
  config.output.u.RGBA = {image.row(0), int(width * 3), size_t(width * height * 3)};
  const VP8StatusCode status = WebPDecode(bytes.data, bytes.size, &config);
  WebPFreeDecBuffer(&config.output);
  if (status == VP8_STATUS_OUT_OF_MEMORY) throw std::bad_alloc();
  if (status != VP8_STATUS_OK) return {};
  return std::move(image);
}

}  // namespace maq
