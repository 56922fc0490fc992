// Decoders and encoders of image files in memory: libpng, libwebp, libjpeg-turbo, and own code for BMP and TIFF.
// Android brings decoders of its own (android/).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/frame.h"
#include "image/files/image_header.h"

namespace maq {

// An image that was decoded, and its memory. No width: it is damaged.
struct DecodedImage {
  ImageView view;
  std::shared_ptr<const void> memory;
};

// Memory for an image without padding between its rows. Throws std::bad_alloc.
struct NewImage : DecodedImage {
  NewImage(maq_pixel_format format, int width_px, int height_px)
      : pixels_(std::make_shared<std::vector<uint8_t>>(packed_bytes(format, width_px, height_px))) {
    view = packed_view(format, width_px, height_px, pixels_->data());
    memory = pixels_;
  }
  uint8_t* row(int y) { return pixels_->data() + size_t(y) * view.planes[0].stride_bytes; }

 private:
  std::shared_ptr<std::vector<uint8_t>> pixels_;
};

// Decodes a PNG, WebP, BMP or TIFF image, as it is stored, to BGR8. Throws MAQ_ERROR_UNSUPPORTED for kinds of BMP and
// TIFF that are not read, and std::bad_alloc.
DecodedImage decode_stored_image(const EncodedBytes& bytes, ImageFormat format);

// `extension`: ".png" or ".jpg". The image is BGR8, GREY8 or, for PNG, RGBA8. Throws MAQ_ERROR_INTERNAL for an image
// that cannot be encoded, and std::bad_alloc.
std::vector<uint8_t> encode_stored_image(const std::string& extension, const ImageView& image);

// Decodes a grey PNG or TIFF image of 16 bits to DEPTH16, a grey TIFF image of floats to DEPTH32F, whatever their unit.
// An image of other pixels has a size and no pixels. Throws MAQ_ERROR_UNSUPPORTED on Android, and std::bad_alloc.
DecodedImage decode_depth_image(const EncodedBytes& bytes, ImageFormat format);

// DEPTH16 as ".png", DEPTH32F as ".tiff". Throws MAQ_ERROR_UNSUPPORTED on Android, and std::bad_alloc.
std::vector<uint8_t> encode_depth_image(const std::string& extension, const ImageView& image);

}  // namespace maq
