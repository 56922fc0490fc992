#include "image/files/png.h"

#include <png.h>

#include <zlib.h>

#include <cstring>
#include <new>
#include <vector>

#include "core/error.h"

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

// `is_memory`: whether memory ended.
[[noreturn]] void fail(png_structp png, png_const_charp text) {
  auto* is_memory = static_cast<bool*>(png_get_error_ptr(png));
  *is_memory = *is_memory || says_out_of_memory(text);
  png_longjmp(png, 1);
}
void ignore(png_structp, png_const_charp) {}

struct PngReader {
  explicit PngReader(Input& input) {
    png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &is_memory, fail, ignore);
    info = png == nullptr ? nullptr : png_create_info_struct(png);
    if (info == nullptr) {
      png_destroy_read_struct(&png, nullptr, nullptr);
      throw std::bad_alloc();
    }
    png_set_read_fn(png, &input, read_bytes);
    png_set_user_limits(png, MAQ_MAX_SIDE_PX, MAQ_MAX_SIDE_PX);
  }
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  // The result for a failed call.
  DecodedImage failure() const {
    if (is_memory) throw std::bad_alloc();
    return {};
  }

  png_structp png = nullptr;
  png_infop info = nullptr;
  bool is_memory = false;
};

// libpng leaves these by longjmp(), so that nothing in them has a destructor.

bool read_head(const PngReader& reader) {
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
bool read_depth_head(const PngReader& reader) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_info(reader.png, reader.info);
  png_set_swap(reader.png);  // PNG has the high byte first
  png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
  return true;
}

bool is_grey_of_16_bits(const PngReader& reader) {
  return png_get_color_type(reader.png, reader.info) == PNG_COLOR_TYPE_GRAY &&
         png_get_bit_depth(reader.png, reader.info) == 16;
}

bool read_pixels(const PngReader& reader, png_bytepp rows) {
  if (setjmp(png_jmpbuf(reader.png))) return false;
  png_read_image(reader.png, rows);
  png_read_end(reader.png, nullptr);
  return true;
}

// For a reader that has read the head.
DecodedImage decode(const PngReader& reader, maq_pixel_format format, size_t pixel_bytes) {
  const size_t width = png_get_image_width(reader.png, reader.info);
  const size_t height = png_get_image_height(reader.png, reader.info);
  const size_t row = width * pixel_bytes;
  if (width * height > size_t(MAQ_MAX_PIXELS) || png_get_rowbytes(reader.png, reader.info) != row) return {};
  NewImage image(format, int(width), int(height));
  std::vector<png_bytep> rows(height);
  for (size_t y = 0; y < height; ++y) rows[y] = image.row(int(y));
  if (!read_pixels(reader, rows.data())) return reader.failure();
  return std::move(image);
}

struct Writer {
  Writer() {
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &is_memory, fail, ignore);
    info = png == nullptr ? nullptr : png_create_info_struct(png);
    if (info == nullptr) {
      png_destroy_write_struct(&png, nullptr);
      throw std::bad_alloc();
    }
    png_set_write_fn(png, this, write_bytes, flush);
  }
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // No exception may pass libpng.
  static void write_bytes(png_structp png, png_bytep from, size_t count) {
    auto* writer = static_cast<Writer*>(png_get_io_ptr(png));
    try {
      writer->bytes.insert(writer->bytes.end(), from, from + count);
      return;
    } catch (const std::bad_alloc&) {
      writer->is_memory = true;
    }
    png_error(png, "no memory");
  }
  static void flush(png_structp) {}

  png_structp png = nullptr;
  png_infop info = nullptr;
  bool is_memory = false;
  std::vector<uint8_t> bytes;
};

bool write_image(const Writer& writer, const ImageView& image, int colours) {
  png_structp png = writer.png;
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(png, Z_BEST_SPEED);
  png_set_compression_strategy(png, Z_RLE);
  png_set_IHDR(png, writer.info, uint32_t(image.width_px), uint32_t(image.height_px),
               image.format == MAQ_PIXEL_DEPTH16 ? 16 : 8, colours, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, writer.info);
  if (image.format == MAQ_PIXEL_BGR8) png_set_bgr(png);
  if (image.format == MAQ_PIXEL_DEPTH16) png_set_swap(png);  // PNG has the high byte first
  for (int y = 0; y < image.height_px; ++y) {
    png_write_row(png, image.planes[0].data + size_t(y) * image.planes[0].stride_bytes);
  }
  png_write_end(png, writer.info);
  return true;
}

}  // namespace

DecodedImage decode_png(const EncodedBytes& bytes) {
  Input input{bytes.data, bytes.size};
  const PngReader reader(input);
  if (!read_head(reader)) return reader.failure();
  return decode(reader, MAQ_PIXEL_BGR8, 3);
}

DecodedImage decode_depth_png(const EncodedBytes& bytes) {
  Input input{bytes.data, bytes.size};
  const PngReader reader(input);
  if (!read_depth_head(reader)) return reader.failure();
  if (is_grey_of_16_bits(reader)) return decode(reader, MAQ_PIXEL_DEPTH16, 2);
  return {{MAQ_PIXEL_DEPTH16,
           int(png_get_image_width(reader.png, reader.info)),
           int(png_get_image_height(reader.png, reader.info)),
           {}},
          nullptr};
}

std::vector<uint8_t> encode_png(const ImageView& image) {
  const bool is_grey = image.format == MAQ_PIXEL_GREY8 || image.format == MAQ_PIXEL_DEPTH16;
  const int colours = is_grey                           ? PNG_COLOR_TYPE_GRAY
                      : image.format == MAQ_PIXEL_RGBA8 ? PNG_COLOR_TYPE_RGB_ALPHA
                                                        : PNG_COLOR_TYPE_RGB;
  Writer writer;
  if (!write_image(writer, image, colours)) {
    if (writer.is_memory) throw std::bad_alloc();
    throw Error(MAQ_ERROR_INTERNAL, "An image of ", image.width_px, " x ", image.height_px,
                " pixels could not be encoded as PNG.");
  }
  return std::move(writer.bytes);
}

}  // namespace maq
