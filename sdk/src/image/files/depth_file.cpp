#include "image/files/depth_file.h"

#include <vector>

#include "core/error.h"
#include "core/files/atomic_file.h"
#include "core/files/file.h"
#include "image/depth.h"
#include "image/files/image_codecs.h"
#include "image/files/image_file.h"

namespace maq {
namespace {

constexpr double kMillimetre = 0.001;

DecodedImage decode_depth(const std::string& path) {
  const std::vector<uint8_t> bytes = read_encoded_image(path);
  check_image_start(bytes, path);
  const ImageFormat format = recognise_format(bytes).format;
  const bool can_be_depth = format == ImageFormat::kPng || format == ImageFormat::kTiff;
  DecodedImage depth;
  if (can_be_depth) {
    depth = decode_depth_image(bytes, format);
    if (depth.view.width_px == 0) {
      throw Error(MAQ_ERROR_UNREADABLE, path, " cannot be decoded: it is damaged; copy it again.");
    }
    check_image_size(depth.view.width_px, depth.view.height_px, path);
  }
  if (depth.view.planes[0].data == nullptr) {
    throw Error(MAQ_ERROR_UNSUPPORTED, path, " is no depth image: its pixels are colours or have 8 bits. ",
                "Save depth as a grey PNG or TIFF of 16 bits or a TIFF of 32-bit floats; leave depth_unit out for "
                "colour images.");
  }
  return depth;
}

float* allocate_floats(Frame& frame, const ImageView& like) {
  return reinterpret_cast<float*>(frame.allocate(MAQ_PIXEL_DEPTH32F, like.width_px, like.height_px));
}

void convert_to_millimetres(const ImageView& depth, Frame& frame) {
  std::vector<float> metres(size_t(depth.width_px) * size_t(depth.height_px));
  depth_in_metres(depth, metres.data());
  auto* to = reinterpret_cast<uint16_t*>(frame.allocate(MAQ_PIXEL_DEPTH16, depth.width_px, depth.height_px));
  for (const float m : metres) {
    const double rounded = double(m) / kMillimetre + 0.5;
    *to++ = rounded < UINT16_MAX ? uint16_t(rounded) : 0;
  }
}

}  // namespace

void read_depth_file(const std::string& path, double unit_m, Frame& frame) {
  const DecodedImage stored = decode_depth(path);
  if (stored.view.format == MAQ_PIXEL_DEPTH16 && unit_m == kMillimetre) {
    copy_packed(stored.view, frame.allocate(MAQ_PIXEL_DEPTH16, stored.view.width_px, stored.view.height_px));
  } else {
    depth_in_metres(stored.view, unit_m, allocate_floats(frame, stored.view));
  }
}

void write_depth_file(const ImageView& depth, const std::string& path) {
  const std::string extension = lower_case_extension(path);
  const bool is_png = extension == ".png";
  if (!is_png && extension != ".tif" && extension != ".tiff") {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " ends neither in .png nor in .tiff, the formats of depth images.");
  }
  AtomicFile file(path);
  Frame stored;
  if (!is_png) {
    depth_in_metres(depth, allocate_floats(stored, depth));
  } else if (depth.format == MAQ_PIXEL_DEPTH16) {
    copy_packed(depth, stored.allocate(depth.format, depth.width_px, depth.height_px));
  } else {
    convert_to_millimetres(depth, stored);
  }
  const std::vector<uint8_t> bytes = encode_depth_image(is_png ? ".png" : ".tiff", stored.image);
  file.append(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace maq
