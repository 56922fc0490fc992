#include "image/files/image_header.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace maq {
namespace {

class Reader {
 public:
  explicit Reader(const EncodedBytes& bytes) : bytes_(bytes) {}

  size_t size() const { return bytes_.size; }
  bool has(size_t offset, size_t count) const { return offset <= bytes_.size && count <= bytes_.size - offset; }
  bool equals(size_t offset, const char* text) const {
    const size_t count = std::strlen(text);
    return has(offset, count) && std::memcmp(bytes_.data + offset, text, count) == 0;
  }
  uint32_t byte(size_t offset) const { return bytes_.data[offset]; }
  uint32_t big16(size_t offset) const { return byte(offset) << 8 | byte(offset + 1); }
  uint32_t big32(size_t offset) const { return big16(offset) << 16 | big16(offset + 2); }
  uint32_t little16(size_t offset) const { return byte(offset) | byte(offset + 1) << 8; }
  uint32_t little24(size_t offset) const { return little16(offset) | byte(offset + 2) << 16; }
  uint32_t little32(size_t offset) const { return little16(offset) | little16(offset + 2) << 16; }

  const uint8_t* at(size_t offset) const { return bytes_.data + offset; }

 private:
  EncodedBytes bytes_;
};

struct JpegSegment {
  uint32_t marker = 0;
  size_t offset = 0;  // position of the marker
};

// Goes from segment to segment of a JPEG image, up to the start of its first scan.
class JpegSegments {
 public:
  explicit JpegSegments(const Reader& in) : in_(in) {}

  // False behind the last, and where there is no segment.
  bool next(JpegSegment& segment) {
    while (in_.has(offset_, 4) && in_.byte(offset_) == 0xff) {
      segment = {in_.byte(offset_ + 1), offset_};
      if (segment.marker == 0xff) {  // padding between segments
        ++offset_;
        continue;
      }
      if (segment.marker == 0xd9) return false;
      const bool has_length = segment.marker != 0x01 && (segment.marker < 0xd0 || segment.marker > 0xd8);
      offset_ += has_length ? 2 + in_.big16(offset_ + 2) : 2;
      return true;
    }
    return false;
  }

 private:
  const Reader& in_;
  size_t offset_ = 2;
};

constexpr uint32_t kStartOfScan = 0xda;

// In a start of frame.
std::optional<SizePx> jpeg_size(const Reader& in) {
  JpegSegments segments(in);
  for (JpegSegment segment; segments.next(segment) && segment.marker != kStartOfScan;) {
    const uint32_t marker = segment.marker;
    if (marker < 0xc0 || marker > 0xcf || marker == 0xc4 || marker == 0xc8 || marker == 0xcc) continue;
    if (!in.has(segment.offset, 9)) return {};
    return SizePx{in.big16(segment.offset + 7), in.big16(segment.offset + 5)};
  }
  return {};
}

std::optional<SizePx> webp_size(const Reader& in) {
  if (!in.has(12, 18)) return {};
  if (in.equals(12, "VP8X")) return SizePx{in.little24(24) + 1, in.little24(27) + 1};
  if (in.equals(12, "VP8L")) {
    const uint32_t bits = in.little32(21);
    return SizePx{(bits & 0x3fff) + 1, (bits >> 14 & 0x3fff) + 1};
  }
  if (in.equals(12, "VP8 ")) return SizePx{in.little16(26) & 0x3fff, in.little16(28) & 0x3fff};
  return {};
}

// Reads a whole TIFF file (TIFF 6.0, section 2): its byte order, 42, the position of its first directory, and the
// directory's entries of 12 bytes each.
class TiffDirectory {
 public:
  explicit TiffDirectory(const Reader& in) : in_(in), is_little_(in.equals(0, "II*")) {}

  bool is_little() const { return is_little_; }
  uint32_t number16(size_t offset) const { return is_little_ ? in_.little16(offset) : in_.big16(offset); }
  uint32_t number32(size_t offset) const { return is_little_ ? in_.little32(offset) : in_.big32(offset); }

  // Returns the position of the entry's value; nothing without such an entry or a TIFF file.
  std::optional<size_t> find(uint32_t tag) const {
    if (!in_.has(0, 8) || (!is_little_ && std::memcmp(in_.at(0), "MM\0*", 4) != 0)) return {};
    const size_t directory = number32(4);
    if (!in_.has(directory, 2)) return {};
    const size_t count = number16(directory);
    for (size_t i = 0; i < count && in_.has(directory + 2 + 12 * i, 12); ++i) {
      const size_t entry = directory + 2 + 12 * i;
      if (number16(entry) == tag) return entry + 8;
    }
    return {};
  }

 private:
  const Reader& in_;
  bool is_little_;
};

// A value has 16 bits or 32, as the entry's type says.
std::optional<SizePx> tiff_size(const Reader& in) {
  constexpr uint32_t kWidth = 256, kHeight = 257, kShort = 3;
  const TiffDirectory directory(in);
  const auto width = directory.find(kWidth), height = directory.find(kHeight);
  if (!width || !height) return {};
  const auto value = [&](size_t at) {
    return directory.number16(at - 6) == kShort ? directory.number16(at) : directory.number32(at);
  };
  return SizePx{value(*width), value(*height)};
}

// Returns the position of EXIF data, behind an optional "Exif"; 0: there are none.
size_t exif_offset(const Reader& in, ImageFormat format) {
  const auto behind_name = [&](size_t offset) {
    return in.has(offset, 6) && std::memcmp(in.at(offset), "Exif\0\0", 6) == 0 ? offset + 6 : offset;
  };
  if (format == ImageFormat::kJpeg) {
    JpegSegments segments(in);
    for (JpegSegment segment; segments.next(segment) && segment.marker != kStartOfScan;) {
      const size_t begin = segment.offset + 4;
      if (segment.marker == 0xe1 && behind_name(begin) != begin) return begin + 6;
    }
  } else if (format == ImageFormat::kPng) {
    for (size_t offset = 8; in.has(offset, 8); offset += 12 + size_t(in.big32(offset))) {
      if (in.equals(offset + 4, "eXIf")) return behind_name(offset + 8);
    }
  } else if (format == ImageFormat::kWebp) {
    for (size_t offset = 12; in.has(offset, 8); offset += 8 + (size_t(in.little32(offset + 4)) + 1) / 2 * 2) {
      if (in.equals(offset, "EXIF")) return behind_name(offset + 8);
    }
  }
  return 0;
}

bool is_svg(const Reader& in) {
  const size_t count = std::min<size_t>(in.size(), 1024);
  const char* text = reinterpret_cast<const char*>(in.at(0));
  const auto contains = [&](const char* part) {
    return std::search(text, text + count, part, part + std::strlen(part)) != text + count;
  };
  return in.equals(0, "<svg") || ((in.equals(0, "<?xml") || in.equals(0, "<!DOCTYPE")) && contains("<svg"));
}

// TGA has no magic number: its kinds of image, and the bits of a pixel.
bool is_tga(const Reader& in) {
  if (!in.has(0, 18) || in.little16(12) == 0 || in.little16(14) == 0) return false;
  const bool has_palette = in.byte(1) == 1;
  if (in.byte(1) > 1 || (in.byte(2) % 8 == 1 && !has_palette)) return false;
  constexpr uint32_t kKinds[] = {1, 2, 3, 9, 10, 11}, kBits[] = {8, 15, 16, 24, 32};
  return std::find(std::begin(kKinds), std::end(kKinds), in.byte(2)) != std::end(kKinds) &&
         std::find(std::begin(kBits), std::end(kBits), in.byte(16)) != std::end(kBits);
}

// ISO/IEC 14496-12: photos of phones and clips have the same container, and a brand.
FormatName of_brand(const Reader& in) {
  for (const char* brand : {"heic", "heix", "heim", "heis", "hevc", "hevx", "mif1", "msf1"}) {
    if (in.equals(8, brand)) return {ImageFormat::kNotRead, "a HEIC image"};
  }
  if (in.equals(8, "avif") || in.equals(8, "avis")) return {ImageFormat::kNotRead, "an AVIF image"};
  if (in.equals(8, "crx ")) return {ImageFormat::kNotRead, "a camera's raw image"};
  return {ImageFormat::kClip, "an MP4 or MOV video"};
}

}  // namespace

FormatName recognise_format(const EncodedBytes& bytes) {
  const Reader in(bytes);
  constexpr uint32_t kAnimated = 2;
  if (in.equals(0, "\xff\xd8\xff")) return {ImageFormat::kJpeg, "a JPEG image"};
  if (in.equals(0, "\x89PNG\r\n\x1a\n")) return {ImageFormat::kPng, "a PNG image"};
  if (in.equals(0, "RIFF") && in.equals(8, "WEBP")) {
    const bool is_animated = in.equals(12, "VP8X") && in.has(20, 1) && (in.byte(20) & kAnimated) != 0;
    if (is_animated) return {ImageFormat::kNotRead, "an animated WebP image"};
    return {ImageFormat::kWebp, "a WebP image"};
  }
  if (in.equals(0, "BM")) return {ImageFormat::kBmp, "a BMP image"};
  if (in.has(0, 4) && (std::memcmp(in.at(0), "II*\0", 4) == 0 || std::memcmp(in.at(0), "MM\0*", 4) == 0)) {
    return {ImageFormat::kTiff, "a TIFF image"};
  }
  if (in.equals(4, "ftyp")) return of_brand(in);
  if (in.equals(0, "RIFF") && in.equals(8, "AVI ")) return {ImageFormat::kClip, "an AVI video"};
  if (in.equals(0, "\x1a\x45\xdf\xa3")) return {ImageFormat::kClip, "a WebM or Matroska video"};
  constexpr struct {
    const char *begin, *name;
  } kNotRead[] = {{"GIF8", "a GIF image"},
                  {"8BPS", "a Photoshop image"},
                  {"%PDF", "a PDF document"},
                  {"\xff\x0a", "a JPEG XL image"},
                  {"\xff\x4f\xff\x51", "a JPEG 2000 image"},
                  {"v/1\x01", "an OpenEXR image"},
                  {"#?RADIANCE", "a Radiance image"},
                  {"gimp xcf", "a GIMP image"},
                  {"qoif", "a QOI image"}};
  for (const auto& format : kNotRead) {
    if (in.equals(0, format.begin)) return {ImageFormat::kNotRead, format.name};
  }
  if (in.equals(4, "JXL \r\n\x87\n")) return {ImageFormat::kNotRead, "a JPEG XL image"};
  if (in.equals(4, "jP  \r\n\x87\n")) return {ImageFormat::kNotRead, "a JPEG 2000 image"};
  if (in.has(0, 4) && std::memcmp(in.at(0), "\0\0\1\0", 4) == 0) return {ImageFormat::kNotRead, "an icon"};
  if (in.has(0, 3) && in.byte(0) == 'P' && in.byte(1) >= '1' && in.byte(1) <= '7' && in.byte(2) <= ' ') {
    return {ImageFormat::kNotRead, "a PNM image"};
  }
  if (is_svg(in)) return {ImageFormat::kNotRead, "an SVG drawing"};
  if (is_tga(in)) return {ImageFormat::kNotRead, "a TGA image"};
  return {ImageFormat::kUnknown, "no image"};
}

std::optional<SizePx> read_image_size(const EncodedBytes& bytes) {
  const Reader in(bytes);
  if (in.equals(0, "\x89PNG\r\n\x1a\n") && in.has(16, 8)) return SizePx{in.big32(16), in.big32(20)};
  if (in.equals(0, "\xff\xd8")) return jpeg_size(in);
  if (in.equals(0, "RIFF") && in.equals(8, "WEBP")) return webp_size(in);
  if (in.equals(0, "GIF8") && in.has(6, 4)) return SizePx{in.little16(6), in.little16(8)};
  if (recognise_format(bytes).format == ImageFormat::kTiff) return tiff_size(in);
  if (in.equals(0, "BM") && in.has(18, 8)) {
    // The height is negative when rows go from top to bottom.
    return SizePx{int32_t(in.little32(18)), std::llabs(int32_t(in.little32(22)))};
  }
  return {};
}

bool looks_like_depth(const EncodedBytes& bytes) {
  constexpr uint32_t kBitsPerSample = 258, kSamplesPerPixel = 277;
  const Reader in(bytes);
  switch (recognise_format(bytes).format) {
    case ImageFormat::kPng: return in.has(24, 2) && in.byte(24) == 16 && in.byte(25) == 0;
    case ImageFormat::kTiff: {
      const TiffDirectory directory(in);
      const auto bits = directory.find(kBitsPerSample), samples = directory.find(kSamplesPerPixel);
      const uint32_t depth = bits ? directory.number16(*bits) : 1;
      return (depth == 16 || depth == 32) && (!samples || directory.number16(*samples) == 1);
    }
    default: return false;
  }
}

std::optional<ExifOrientationPlace> find_exif_orientation(const EncodedBytes& bytes) {
  const Reader all(bytes);
  const size_t begin = exif_offset(all, recognise_format(bytes).format);
  if (begin == 0 || !all.has(begin, 8)) return {};
  constexpr uint32_t kOrientation = 274;
  const Reader in({bytes.data + begin, bytes.size - begin});  // a TIFF file
  const TiffDirectory directory(in);
  const auto place = directory.find(kOrientation);
  if (!place) return {};
  return ExifOrientationPlace{begin + *place, directory.is_little()};
}

int read_exif_orientation(const EncodedBytes& bytes) {
  const auto place = find_exif_orientation(bytes);
  if (!place) return 1;
  const Reader in(bytes);
  const uint32_t orientation = place->is_little_endian ? in.little16(place->offset) : in.big16(place->offset);
  return orientation >= 1 && orientation <= 8 ? int(orientation) : 1;
}

bool has_jpeg_end(const EncodedBytes& bytes) {
  const Reader in(bytes);
  JpegSegments segments(in);
  for (JpegSegment segment; segments.next(segment);) {
    if (segment.marker != kStartOfScan) continue;
    // In coded data, 0 follows 0xff.
    constexpr uint8_t kEnd[] = {0xff, 0xd9};
    const uint8_t* end = in.at(in.size());
    return std::search(in.at(segment.offset), end, std::begin(kEnd), std::end(kEnd)) != end;
  }
  return false;
}

}  // namespace maq
