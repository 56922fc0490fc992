// The format, size and orientation of an encoded image, read before it is decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace maq {

// An encoded image, or its beginning, in memory of another owner.
struct EncodedBytes {
  EncodedBytes(const uint8_t* first, size_t count) : data(first), size(count) {}
  EncodedBytes(const std::vector<uint8_t>& bytes) : data(bytes.data()), size(bytes.size()) {}
  const uint8_t* data;
  size_t size;
};

enum class ImageFormat {
  kUnknown,
  kJpeg,
  kPng,
  kWebp,
  kBmp,
  kTiff,
  kNotRead,  // an image of a format that the SDK does not read
  kClip      // no image, but a video file
};

struct FormatName {
  ImageFormat format;
  const char* name;  // with its article: "a GIF image"
};

// By the first 64 bytes, or a few more for SVG, which is text.
FormatName recognise_format(const EncodedBytes& bytes);

struct SizePx {
  int64_t width = 0;
  int64_t height = 0;
};

// Reads PNG, JPEG, WebP, BMP, GIF and TIFF, whose header may lie at the end of the file; nothing for other formats and
// for truncated headers.
std::optional<SizePx> read_image_size(const EncodedBytes& bytes);

// Whether the header is of a grey PNG image of 16 bits, or a grey TIFF image of 16 or 32: as depth cameras write depth.
bool looks_like_depth(const EncodedBytes& bytes);

// The EXIF orientation (Exif 2.32, 4.6.4, tag 274) of a whole JPEG, PNG or WebP image: 1 to 8, and 1 where there is
// none.
int read_exif_orientation(const EncodedBytes& bytes);

// The position of that number in the image, as two bytes.
struct ExifOrientationPlace {
  size_t offset = 0;
  bool is_little_endian = false;
};
std::optional<ExifOrientationPlace> find_exif_orientation(const EncodedBytes& bytes);

// Whether a JPEG image has its last marker, which is missing from one that was cut.
bool has_jpeg_end(const EncodedBytes& bytes);

}  // namespace maq
