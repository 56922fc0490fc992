#include "image/files/png.h"

#include <png.h>

#include <cstring>
#include <vector>

namespace maq {
namespace {

struct Input {
  const uint8_t* bytes;
  size_t left;
};

void read_bytes(png_structp png, png_bytep to, size_t count) {
  auto* input = static_cast<Input*>(png_get_io_ptr(png));
  if (count > input->left) png_error(png, "it ends early");
  std::memcpy(to, input->bytes, count);
  input->bytes += count;
  input->left -= count;
}

[[noreturn]] void fail(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void ignore(png_structp, png_const_charp) {}

struct Reader {
  explicit Reader(Input& input) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, fail, ignore);
    info = png == nullptr ? nullptr : png_create_info_struct(png);
    if (info == nullptr) return;
    png_set_read_fn(png, &input, read_bytes);
    png_set_user_limits(png, MAQ_MAX_SIDE_PX, MAQ_MAX_SIDE_PX);
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  png_structp png = nullptr;
  png_infop info = nullptr;
};

// libpng leaves these by longjmp(), so that nothing in them has a destructor.

bool read_head(const Reader& reader) {
  png_structp png = reader.png;
  if (setjmp(png_jmpbuf(png))) return false;
  png_read_info(png, reader.info);
  const int colours = png_get_color_type(png, reader.info);
  png_set_strip_16(png);
  png_set_strip_alpha(png);
  if (colours == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if ((colours & PNG_COLOR_MASK_COLOR) == 0) {
    png_set_expand_gray_1_2_4_to_8(png);
    png_set_gray_to_rgb(png);
  }
  png_set_bgr(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, reader.info);
  return true;
}

// Grey of 16 bits stays as it is; of other pixels the head is read and no more.
bool read_depth_head(const Reader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_info(reader.png, reader.info);
  png_set_swap(reader.png);  // PNG has the high byte first
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool is_grey_of_16_bits(const Reader& reader) {
  return png_get_color_type(reader.png, reader.info) == PNG_COLOR_TYPE_GRAY &&
         png_get_bit_depth(reader.png, reader.info) == 16;
}

bool read_pixels(const Reader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

// For a reader that has read the head.
DecodedImage decode(const Reader& reader, maq_pixel_format format, size_t pixel_bytes) {
  const size_t width = png_get_image_width(reader.png, reader.info);
  const size_t height = png_get_image_height(reader.png, reader.info);
  const size_t row = width * pixel_bytes;
  if (width * height > size_t(MAQ_MAX_PIXELS) || png_get_rowbytes(reader.png, reader.info) != row) return {};
  const auto pixels = std::make_shared<std::vector<uint8_t>>(height * row);
  std::vector<png_bytep> rows(height);
  for (size_t y = 0; y < height; ++y) rows[y] = pixels->data() + y * row;
  if (!read_pixels(reader, rows.data())) return {};
  return {{format, int(width), int(height), {{pixels->data(), row}, {}}}, pixels};
}

}  // namespace

DecodedImage decode_png(const uint8_t* bytes, size_t size_bytes) {
  Input input{bytes, size_bytes};
  const Reader reader(input);
  if (reader.info == nullptr) throw std::bad_alloc();
  if (!read_head(reader)) return {};
  return decode(reader, MAQ_PIXEL_BGR8, 3);
}

DecodedImage decode_depth_png(const uint8_t* bytes, size_t size_bytes) {
  Input input{bytes, size_bytes};
  const Reader reader(input);
  if (reader.info == nullptr) throw std::bad_alloc();
  if (!read_depth_head(reader)) return {};
  if (is_grey_of_16_bits(reader)) return decode(reader, MAQ_PIXEL_DEPTH16, 2);
  return {{MAQ_PIXEL_DEPTH16,
           int(png_get_image_width(reader.png, reader.info)),
           int(png_get_image_height(reader.png, reader.info)),
           {}},
          nullptr};
}

}  // namespace maq
