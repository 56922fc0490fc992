#include "image/files/image_header.h"

#include <cstdlib>
#include <cstring>

namespace maq {
namespace {

class Reader {
 public:
  explicit Reader(const std::vector<uint8_t>& bytes) : bytes_(bytes) {}

  bool has(size_t offset, size_t count) const { return offset <= bytes_.size() && count <= bytes_.size() - offset; }
  bool equals(size_t offset, const char* text) const {
    const size_t count = std::strlen(text);
    return has(offset, count) && std::memcmp(bytes_.data() + offset, text, count) == 0;
  }
  uint32_t byte(size_t offset) const { return bytes_[offset]; }
  uint32_t big16(size_t offset) const { return byte(offset) << 8 | byte(offset + 1); }
  uint32_t big32(size_t offset) const { return big16(offset) << 16 | big16(offset + 2); }
  uint32_t little16(size_t offset) const { return byte(offset) | byte(offset + 1) << 8; }
  uint32_t little24(size_t offset) const { return little16(offset) | byte(offset + 2) << 16; }
  uint32_t little32(size_t offset) const { return little16(offset) | little16(offset + 2) << 16; }

 private:
  const std::vector<uint8_t>& bytes_;
};

// Walks the segments up to a start of frame, which holds the size.
std::optional<SizePx> jpeg_size(const Reader& in) {
  size_t offset = 2;
  while (in.has(offset, 4)) {
    if (in.byte(offset) != 0xff) return {};
    const uint32_t marker = in.byte(offset + 1);
    if (marker == 0xff) {  // padding between segments
      ++offset;
      continue;
    }
    const bool start_of_frame = marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (start_of_frame) {
      if (!in.has(offset, 9)) return {};
      return SizePx{in.big16(offset + 7), in.big16(offset + 5)};
    }
    if (marker == 0xda || marker == 0xd9) return {};
    const bool without_length = marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8);
    offset += without_length ? 2 : 2 + in.big16(offset + 2);
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

}  // namespace

std::optional<SizePx> read_image_size(const std::vector<uint8_t>& bytes) {
  const Reader in(bytes);
  if (in.equals(0, "\x89PNG\r\n\x1a\n") && in.has(16, 8)) return SizePx{in.big32(16), in.big32(20)};
  if (in.equals(0, "\xff\xd8")) return jpeg_size(in);
  if (in.equals(0, "RIFF") && in.equals(8, "WEBP")) return webp_size(in);
  if (in.equals(0, "GIF8") && in.has(6, 4)) return SizePx{in.little16(6), in.little16(8)};
  if (in.equals(0, "BM") && in.has(18, 8)) {
    // The height is negative when rows go from top to bottom.
    return SizePx{int32_t(in.little32(18)), std::llabs(int32_t(in.little32(22)))};
  }
  return {};
}

}  // namespace maq
