#include "image/files/image_file.h"

#include <algorithm>

#include "core/error.h"
#include "core/files/atomic_file.h"
#include "core/files/file.h"
#include "core/files/file_reader.h"
#include "image/convert.h"
#include "image/files/image_codecs.h"
#include "image/files/jpeg.h"
#include "image/files/origin_mark.h"

namespace maq {
namespace {

// More than an uncompressed image of MAQ_MAX_PIXELS, at 16 bits and four channels.
constexpr uint64_t kMaxImageBytes = uint64_t(1) << 30;

constexpr char kReadFormats[] = "JPEG, PNG, WebP, BMP or TIFF";

[[noreturn]] void fail_to_decode(const std::string& origin) {
  throw Error(MAQ_ERROR_UNREADABLE, origin, " cannot be decoded: it is damaged or no image; use a whole ", kReadFormats,
              " file.");
}

// The format of an image by its first bytes. Throws for unsupported formats.
ImageFormat format_of(const EncodedBytes& start, const std::string& origin) {
  const auto [format, name] = recognise_format(start);
  if (format == ImageFormat::kClip) {
    throw Error(MAQ_ERROR_UNSUPPORTED, origin, " is ", name, ", no image; open the file as a source, as video:.");
  }
  if (format == ImageFormat::kNotRead) {
    throw Error(MAQ_ERROR_UNSUPPORTED, origin, " is ", name, ", which is not read; save it as ", kReadFormats, ".");
  }
  return format;
}

// Makes the image of `frame`, BGR8 in its own memory, upright.
void apply_orientation(Frame& frame, int orientation) {
  if (orientation == 1) return;
  const bool is_transposed = orientation >= 5;
  const int width = frame.image.width_px, height = frame.image.height_px;
  const std::vector<uint8_t> stored = std::move(frame.storage);
  uint8_t* to = frame.allocate_bgr(is_transposed ? height : width, is_transposed ? width : height);
  // Which stored pixel is the first of the upright image, and how far it is to the next across and down.
  const bool from_right = orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8;
  const bool from_bottom = orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
  const ptrdiff_t column = from_right ? -3 : 3, row = ptrdiff_t(from_bottom ? -3 : 3) * width;
  const uint8_t* first = stored.data() + (from_right ? ptrdiff_t(width - 1) * 3 : 0) +
                         (from_bottom ? ptrdiff_t(height - 1) * width * 3 : 0);
  const ptrdiff_t across = is_transposed ? row : column, down = is_transposed ? column : row;
  // In tiles, so that stored rows that were read stay in the cache.
  constexpr int kTile = 32;
  const int columns = frame.image.width_px, rows = frame.image.height_px;
  for (int y0 = 0; y0 < rows; y0 += kTile) {
    for (int x0 = 0; x0 < columns; x0 += kTile) {
      for (int y = y0; y < std::min(y0 + kTile, rows); ++y) {
        const uint8_t* from = first + y * down + x0 * across;
        uint8_t* pixel = to + (ptrdiff_t(y) * columns + x0) * 3;
        for (int x = x0; x < std::min(x0 + kTile, columns); ++x, from += across, pixel += 3) {
          std::copy_n(from, 3, pixel);
        }
      }
    }
  }
}

void decode_jpeg(const EncodedBytes& bytes, const std::string& origin, Frame& frame) {
  const JpegResult result = decode_jpeg_photo(bytes.data, bytes.size, frame);
  if (result == JpegResult::kDamaged) fail_to_decode(origin);
  if (result == JpegResult::kTruncated) {
    throw Error(MAQ_ERROR_UNREADABLE, origin, " is truncated: the end of the JPEG image is missing; copy it again.");
  }
}

}  // namespace

void check_image_start(const EncodedBytes& start, const std::string& origin) {
  if (start.size == 0) throw Error(MAQ_ERROR_UNREADABLE, origin, " is empty; an image was expected.");
  if (format_of(start, origin) == ImageFormat::kUnknown) fail_to_decode(origin);
  if (const auto size = read_image_size(start)) check_image_size(size->width, size->height, origin);
}

std::vector<uint8_t> read_encoded_image(const std::string& path) {
  return read_file(path, kMaxImageBytes, [&](const std::vector<uint8_t>& start) { check_image_start(start, path); });
}

void decode_image(const EncodedBytes& bytes, const std::string& origin, Frame& frame, Orientation orientation) {
  if (bytes.size > kMaxImageBytes) throw Error(MAQ_ERROR_UNREADABLE, origin, " is over 1 GiB; is it an image?");
  check_image_start(bytes, origin);
  const ImageFormat format = recognise_format(bytes).format;
  if (format == ImageFormat::kJpeg) {
    decode_jpeg(bytes, origin, frame);
  } else {
    const DecodedImage image = decode_stored_image(bytes, format);
    if (image.view.width_px == 0 || image.view.planes[0].data == nullptr) fail_to_decode(origin);
    check_image_size(image.view.width_px, image.view.height_px, origin);
    uint8_t* pixels = frame.allocate_bgr(image.view.width_px, image.view.height_px);
    copy_pixels(image.view, MAQ_PIXEL_BGR8, pixels, 0, frame.storage.size());
  }
  frame.origin = read_origin_mark(bytes);
  if (orientation == Orientation::kUpright) apply_orientation(frame, read_exif_orientation(bytes));
}

void read_image_file(const std::string& path, Frame& frame, Orientation orientation) {
  decode_image(read_encoded_image(path), path, frame, orientation);
}

SizePx read_image_file_size(const std::string& path) {
  {
    FileReader file(path);
    // Up to a JPEG's size there may be a preview and colour tables.
    std::vector<uint8_t> start(size_t(std::min<uint64_t>(file.remaining(), 1 << 18)));
    file.read(start.data(), start.size());
    format_of(start, path);
    if (const auto size = read_image_size(start)) return *size;
  }
  Frame frame;
  read_image_file(path, frame, Orientation::kAsStored);
  return {frame.image.width_px, frame.image.height_px};
}

std::vector<uint8_t> encode_image(const ImageView& image, const std::string& extension) {
  std::vector<uint8_t> memory;
  return encode_stored_image(extension, image.format == MAQ_PIXEL_GREY8 ? image : as_bgr(image, memory));
}

void write_image_file(const ImageView& image, const std::string& path, const FrameOrigin& origin) {
  const std::string extension = lower_case_extension(path);
  if (extension != ".png" && extension != ".jpg" && extension != ".jpeg") {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " ends neither in .png nor in .jpg, by which its format is chosen.");
  }
  AtomicFile file(path);
  std::vector<uint8_t> bytes = encode_image(image, extension == ".png" ? extension : ".jpg");
  mark_origin(origin, extension, bytes);
  file.append(bytes.data(), bytes.size());
  file.commit();
}

void write_image_file(const ImageView& image, const uint8_t* alpha, const std::string& path) {
  if (lower_case_extension(path) != ".png") {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " does not end in .png, the format for images with alpha.");
  }
  AtomicFile file(path);
  std::vector<uint8_t> rgba(size_t(4) * size_t(image.width_px) * size_t(image.height_px));
  uint8_t* to = rgba.data();
  for (int y = 0; y < image.height_px; ++y) {
    const uint8_t* from = image.planes[0].data + size_t(y) * image.planes[0].stride_bytes;
    for (int x = 0; x < image.width_px; ++x, from += 3, to += 4) {
      to[0] = from[2];
      to[1] = from[1];
      to[2] = from[0];
      to[3] = *alpha++;
    }
  }
  const ImageView picture{
      MAQ_PIXEL_RGBA8, image.width_px, image.height_px, {{rgba.data(), size_t(4) * size_t(image.width_px)}, {}}};
  const std::vector<uint8_t> bytes = encode_stored_image(".png", picture);
  file.append(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace maq
