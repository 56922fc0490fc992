#include "image/files/bmp.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "core/error.h"

namespace maq {
namespace {

// The headers of a BMP file (BITMAPFILEHEADER, BITMAPINFOHEADER); numbers are little-endian.
class Header {
 public:
  explicit Header(const EncodedBytes& bytes) : bytes_(bytes) {}

  bool is_whole() const { return bytes_.size >= 54 && info_bytes() >= 40 && pixels_at() <= bytes_.size; }
  uint32_t pixels_at() const { return number(10, 4); }
  uint32_t info_bytes() const { return number(14, 4); }
  int64_t width_px() const { return int32_t(number(18, 4)); }
  int64_t signed_height_px() const { return int32_t(number(22, 4)); }  // negative: the first row is the top
  uint32_t bits() const { return number(28, 2); }
  uint32_t compression() const { return number(30, 4); }
  // Without compression, or with masks of the usual order: blue, green and red in the first three bytes.
  bool is_plain() const {
    constexpr uint32_t kMasks = 3;
    if (compression() != kMasks) return compression() == 0;
    return bits() == 32 && bytes_.size >= 66 && number(54, 4) == 0xff0000 && number(58, 4) == 0xff00 &&
           number(62, 4) == 0xff;
  }

  // Colours of the palette, black where it ends.
  std::array<std::array<uint8_t, 3>, 256> palette() const {
    std::array<std::array<uint8_t, 3>, 256> colours{};
    const size_t asked = number(46, 4) == 0 ? size_t(1) << bits() : number(46, 4);
    const size_t first = size_t(14) + info_bytes();
    for (size_t i = 0; i < std::min<size_t>(asked, 256) && first + 4 * i + 4 <= bytes_.size; ++i) {
      std::copy_n(bytes_.data + first + 4 * i, 3, colours[i].begin());
    }
    return colours;
  }

 private:
  uint32_t number(size_t at, size_t size) const {
    uint32_t value = 0;
    for (size_t i = 0; i < size; ++i) value |= uint32_t(bytes_.data[at + i]) << (8 * i);
    return value;
  }

  const EncodedBytes& bytes_;
};

}  // namespace

DecodedImage decode_bmp(const EncodedBytes& bytes) {
  const Header header(bytes);
  if (!header.is_whole()) return {};
  const int64_t width = header.width_px(), height = std::abs(header.signed_height_px());
  if (width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX) return {};
  const uint32_t bits = header.bits();
  if (!header.is_plain() || (bits != 1 && bits != 4 && bits != 8 && bits != 24 && bits != 32)) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "A BMP image of this kind (", bits, " bits a pixel, compression ",
                header.compression(), ") is not read; save it as PNG.");
  }
  const size_t row_bytes = (size_t(width) * bits + 31) / 32 * 4;
  if (width * height > MAQ_MAX_PIXELS || (bytes.size - header.pixels_at()) / row_bytes < size_t(height)) return {};
  const auto palette = bits <= 8 ? header.palette() : std::array<std::array<uint8_t, 3>, 256>{};
  NewImage image(MAQ_PIXEL_BGR8, int(width), int(height));
  for (int y = 0; y < int(height); ++y) {
    const uint8_t* from = bytes.data + header.pixels_at() + size_t(y) * row_bytes;
    uint8_t* to = image.row(header.signed_height_px() < 0 ? y : int(height) - 1 - y);
    for (size_t x = 0; x < size_t(width); ++x, to += 3) {
      if (bits > 8) {
        std::copy_n(from + x * bits / 8, 3, to);
      } else {
        const size_t shift = 8 - bits - x * bits % 8;
        std::copy_n(palette[from[x * bits / 8] >> shift & ((1u << bits) - 1)].begin(), 3, to);
      }
    }
  }
  return std::move(image);
}

}  // namespace maq
