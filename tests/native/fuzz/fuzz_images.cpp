// Encoded images, and frames with any strides.
#include "core/frame.h"
#include "fuzz_target.h"
#include "image/convert.h"
#include "image/depth.h"
#include "image/files/depth_file.h"
#include "image/files/image_file.h"
#include "image/files/image_header.h"
#include "image/files/jpeg.h"
#include "image/geometry/resize.h"
#include "image/yuv_planes.h"
#include "support/temp_folder.h"

using namespace maq;

namespace {

constexpr int64_t kMaxPixels = 1 << 18;  // larger images only take longer

bool is_small(const fuzz::Bytes& bytes) {
  const auto size = read_image_size(bytes);
  return !size || (size->width <= kMaxPixels && size->height <= kMaxPixels && size->width * size->height <= kMaxPixels);
}

// Reads every pixel.
void use(const ImageView& image) {
  fuzz::Bytes copy(packed_bytes(image.format, image.width_px, image.height_px));
  copy_packed(image, copy.data());
}

fuzz::Bytes picture() {
  fuzz::Bytes pixels(12 * 10 * 3);
  for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = uint8_t(i * 37 % 256);
  return pixels;
}

fuzz::Bytes bmp() {
  fuzz::Writer file;
  file.text("BM")
      .add(uint32_t(70))
      .add(uint32_t(0))
      .add(uint32_t(54))
      .add(uint32_t(40))
      .add(int32_t(2))
      .add(int32_t(2));
  file.add(uint16_t(1)).add(uint16_t(24)).add(uint32_t(0)).add(uint32_t(16));
  for (int i = 0; i < 4; ++i) file.add(uint32_t(0));
  return file.text(std::string(16, 'a')).bytes;
}

fuzz::Bytes tiff() {
  constexpr std::pair<int, uint32_t> kEntries[] = {{256, 2},   {257, 2}, {258, 8}, {259, 1}, {262, 1},
                                                   {273, 134}, {277, 1}, {278, 2}, {279, 4}, {284, 1}};
  fuzz::Writer file;
  file.text("II*").add('\0').add(uint32_t(8)).add(uint16_t(std::size(kEntries)));
  for (const auto& [tag, value] : kEntries) file.add(uint16_t(tag)).add(uint16_t(4)).add(uint32_t(1)).add(value);
  return file.add(uint32_t(0)).text("abcd").bytes;
}

std::vector<fuzz::Bytes> image_seeds() {
  const fuzz::Bytes pixels = picture();
  const ImageView colour = packed_view(MAQ_PIXEL_BGR8, 12, 10, pixels.data());
  const ImageView grey = packed_view(MAQ_PIXEL_GREY8, 12, 10, pixels.data());
  return {encode_image(colour, ".png"),
          encode_image(grey, ".png"),
          encode_image(colour, ".jpg"),
          encode_image(grey, ".jpg"),
          bmp(),
          tiff()};
}

std::vector<fuzz::Bytes> depth_seeds() {
  const TempFolder folder;
  const fuzz::Bytes pixels = picture();
  write_depth_file(packed_view(MAQ_PIXEL_DEPTH16, 12, 10, pixels.data()), folder.file("a.png"));
  write_depth_file(packed_view(MAQ_PIXEL_DEPTH32F, 9, 10, pixels.data()), folder.file("a.tiff"));
  return {fuzz::bytes_of(read_text(folder.file("a.png"))), fuzz::bytes_of(read_text(folder.file("a.tiff")))};
}

std::vector<fuzz::Bytes> jpeg_seeds() {
  const fuzz::Bytes pixels = picture();
  fuzz::Bytes bytes;
  JpegEncoder().encode(packed_view(MAQ_PIXEL_BGR8, 12, 10, pixels.data()), 80, bytes);
  return {bytes};
}

std::vector<fuzz::Bytes> frame_seeds() {
  std::vector<fuzz::Bytes> seeds;
  for (int format = MAQ_PIXEL_RGB8; format <= MAQ_PIXEL_DEPTH32F; ++format) {
    fuzz::Writer seed;
    seed.within(format, MAQ_PIXEL_RGB8).within(7, 1).within(5, 1).add(uint32_t(32)).add(uint32_t(16));
    seeds.push_back(seed.text(std::string(300, 'a')).bytes);
  }
  return seeds;
}

std::vector<fuzz::Bytes> yuv_seeds() {
  fuzz::Writer seed;
  seed.within(6, 1).within(4, 1).within(1, 0).within(1, 0);
  for (const int pixel_stride : {1, 2, 2}) {
    seed.add(int32_t(8)).within(pixel_stride, -1).within(64, 0).text(std::string(64, 'y'));
  }
  return {seed.bytes};
}

}  // namespace

SEEDED_FUZZ(image_header, image_seeds) {
  recognise_format(bytes);
  read_image_size(bytes);
  has_jpeg_end(bytes);
  looks_like_depth(bytes);
  const int orientation = read_exif_orientation(bytes);
  fuzz::require(orientation >= 1 && orientation <= 8, "an orientation outside 1 to 8");
  const auto place = find_exif_orientation(bytes);
  fuzz::require(!place || place->offset + 2 <= bytes.size(), "an orientation outside the image");
}

SEEDED_FUZZ(image, image_seeds) {
  if (!is_small(bytes)) return;
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED, MAQ_ERROR_IMAGE_SIZE}, [&] {
    Frame frame;
    decode_image(bytes, "a", frame);
    use(frame.image);
  });
}

SEEDED_FUZZ(depth_image, depth_seeds) {
  if (!is_small(bytes)) return;
  const fuzz::MemoryFile file(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED, MAQ_ERROR_IMAGE_SIZE}, [&] {
    Frame frame;
    read_depth_file(file.path(), 0.001, frame);
    use(frame.image);
  });
}

SEEDED_FUZZ(camera_jpeg, jpeg_seeds) {
  static JpegDecoder decoder;
  Frame frame;
  if (decoder.decode(bytes.data(), bytes.size(), kMaxPixels, frame)) use(frame.image);
}

SEEDED_FUZZ(frame, frame_seeds) {
  fuzz::Numbers numbers(bytes);
  maq_frame_desc desc{};
  desc.struct_size = sizeof desc;
  desc.format = maq_pixel_format(numbers.within(MAQ_PIXEL_RGB8, MAQ_PIXEL_DEPTH32F));
  desc.width_px = numbers.within(1, 64);
  desc.height_px = numbers.within(1, 64);
  fuzz::Bytes planes[2];
  for (int plane = 0; plane < plane_count(desc.format); ++plane) {
    desc.stride_bytes[plane] = numbers.take<uint32_t>();
    const size_t row = row_bytes(desc.format, plane, desc.width_px);
    const auto needed = bytes_of_rows(desc.stride_bytes[plane] != 0 ? desc.stride_bytes[plane] : row,
                                      plane_rows(desc.format, plane, desc.height_px), row);
    if (needed && *needed > 1 << 16) return;
    planes[plane].resize(needed.value_or(0));
    for (uint8_t& value : planes[plane]) value = numbers.take<uint8_t>();
    desc.planes[plane] = planes[plane].data();
  }
  fuzz::run_or_refuse({MAQ_ERROR_INVALID_ARGUMENT, MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_UNSUPPORTED}, [&] {
    const ImageView image = checked_image_view(desc);
    use(image);
    if (is_depth(image.format)) {
      std::vector<float> metres(size_t(image.width_px) * size_t(image.height_px));
      depth_in_metres(image, metres.data());
      for (const float depth : metres) fuzz::require(depth >= 0 && std::isfinite(depth), "depth that is no length");
      return;
    }
    Frame resized;
    resize_to_bgr(image, numbers.within(1, 64), numbers.within(1, 64), resized);
    for (const maq_pixel_format format : {MAQ_PIXEL_RGB8, MAQ_PIXEL_BGR8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_GREY8}) {
      fuzz::Bytes out(size_t(numbers.within(0, 4096)));
      copy_pixels(image, format, out.data(), size_t(numbers.within(0, 300)), out.size());
    }
  });
}

SEEDED_FUZZ(yuv_image, yuv_seeds) {
  fuzz::Numbers numbers(bytes);
  YuvImage image;
  image.width_px = numbers.within(1, 64);
  image.height_px = numbers.within(1, 64);
  image.is_full_range = numbers.within(0, 1) != 0;
  const int turns = numbers.within(0, 3);
  fuzz::Bytes planes[3];
  for (size_t i = 0; i < 3; ++i) {
    image.planes[i].row_stride = numbers.take<int32_t>();
    image.planes[i].pixel_stride = numbers.within(-1, 8);
    planes[i] = numbers.bytes(size_t(numbers.within(0, 8192)));
    planes[i].shrink_to_fit();
    image.planes[i].data = planes[i].data();
    image.planes[i].bytes = planes[i].size();
  }
  if (yuv_image_problem(image)) return;
  fuzz::Bytes nv12(packed_bytes(MAQ_PIXEL_NV12, turns % 2 == 0 ? image.width_px : image.height_px,
                                turns % 2 == 0 ? image.height_px : image.width_px));
  yuv_to_nv12(image, turns, nv12.data());
}
