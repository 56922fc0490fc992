#include "image/files/image_file.h"

#include <algorithm>
#include <filesystem>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/file.h"
#include "core/file_reader.h"
#include "image/convert.h"
#include "image/files/file_codecs.h"

namespace maq {

void read_image_file(const std::string& path, Frame& frame, Orientation orientation) {
  std::error_code ignored;  // what is no file is for read_file() to say
  const uintmax_t size_bytes = std::filesystem::file_size(path, ignored);
  if (!ignored && size_bytes > uintmax_t(1) << 30) {
    throw Error(MAQ_ERROR_UNREADABLE, path, " is over 1 GiB; an image file was expected.");
  }
  const std::vector<uint8_t> bytes = read_file(path);
  if (bytes.empty()) throw Error(MAQ_ERROR_UNREADABLE, path, " is empty; an image file was expected.");
  if (const auto size = read_image_size(bytes)) check_image_size(size->width, size->height, path);

  const DecodedImage image = file_codecs().decode_image(bytes.data(), bytes.size(), orientation);
  if (image.view.width_px == 0) {
    throw Error(MAQ_ERROR_UNREADABLE, path,
                " cannot be decoded: it is damaged or no image; use a whole JPEG, PNG, WebP, BMP or TIFF file.");
  }
  check_image_size(image.view.width_px, image.view.height_px, path);
  uint8_t* pixels = frame.allocate_bgr(image.view.width_px, image.view.height_px);
  copy_pixels(image.view, MAQ_PIXEL_BGR8, pixels, 0, frame.storage.size());
}

SizePx read_image_file_size(const std::string& path) {
  {
    FileReader file(path);
    // Up to a JPEG's size there may be a preview and colour tables.
    std::vector<uint8_t> start(size_t(std::min<uint64_t>(file.remaining(), 1 << 18)));
    file.read(start.data(), start.size());
    if (const auto size = read_image_size(start)) return *size;
  }
  Frame frame;
  read_image_file(path, frame, Orientation::kAsStored);
  return {frame.image.width_px, frame.image.height_px};
}

std::vector<uint8_t> encode_image(const ImageView& image, const std::string& extension) {
  std::vector<uint8_t> memory, bytes;
  const ImageView picture = image.format == MAQ_PIXEL_GREY8 ? image : as_bgr(image, memory);
  if (!file_codecs().encode_image(extension, picture, bytes)) {
    throw Error(MAQ_ERROR_INTERNAL, "A picture of ", image.width_px, " x ", image.height_px,
                " could not be encoded as ", extension, ": there may be too little memory.");
  }
  return bytes;
}

void write_image_file(const ImageView& image, const std::string& path) {
  const std::string extension = lower_case_extension(path);
  if (extension != ".png" && extension != ".jpg" && extension != ".jpeg") {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " ends neither in .png nor in .jpg, by which its format is chosen.");
  }
  AtomicFile file(path);
  const std::vector<uint8_t> bytes = encode_image(image, extension == ".png" ? extension : ".jpg");
  file.append(bytes.data(), bytes.size());
  file.commit();
}

}  // namespace maq
