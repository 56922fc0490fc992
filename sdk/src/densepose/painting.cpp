#include "densepose/painting.h"

#include <algorithm>
#include <array>
#include <vector>

#include "densepose/body_parts.h"
#include "image/convert.h"

namespace maq {
namespace {

constexpr int kBandRows = 16;  // even; converted at once, in the cache

// Colour of a part: the value it adds to a channel, and the weight of the frame, both times 255.
struct Paint {
  std::array<int, 3> rgb;
  int kept;
  uint8_t alpha;
};
using Palette = std::array<Paint, kBodyParts.size()>;

Palette palette_of(int opacity, bool has_frame) {
  Palette palette;
  for (size_t part = 0; part < palette.size(); ++part) {
    const int covers = part == 0 ? 0 : opacity;
    const auto& rgb = kBodyParts[part].rgb;
    palette[part] = {
        {rgb[0] * covers, rgb[1] * covers, rgb[2] * covers}, 255 - covers, uint8_t(has_frame ? 255 : covers)};
  }
  return palette;
}

// value / 255, rounded; exact up to 255 * 255.
uint8_t divided_by_255(int value) {
  const int half = value + 128;
  return uint8_t((half + (half >> 8)) >> 8);
}

// `bgr` null: no frame.
void paint_row(const Palette& palette, const uint8_t* parts, const uint8_t* bgr, int width, int step, uint8_t* rgba) {
  for (int x = 0; x < width; ++x, rgba += step) {
    const Paint& paint = palette[std::min<size_t>(parts[x], palette.size() - 1)];
    for (int channel = 0; channel < 3; ++channel) {
      const int under = bgr == nullptr ? 0 : bgr[3 * x + 2 - channel] * paint.kept;
      rgba[channel] = divided_by_255(under + paint.rgb[size_t(channel)]);
    }
    rgba[3] = paint.alpha;
  }
}

}  // namespace

void paint_people(const DensePlanes& planes, const ImageView* frame, const Painting& painting, uint8_t* rgba,
                  size_t stride_bytes) {
  const Palette palette = palette_of(painting.opacity, frame != nullptr);
  const int step = painting.is_mirrored ? -4 : 4;
  uint8_t* const first = rgba + (painting.is_mirrored ? 4 * (ptrdiff_t(painting.width_px) - 1) : 0);
  const int end = painting.y_px + painting.height_px;
  const int left = painting.x_px / 2 * 2;  // of YUV images two pixels share their colour
  std::vector<uint8_t> memory;
  for (int band = painting.y_px / 2 * 2; band < end; band += kBandRows) {
    const int rows = std::min(kBandRows, end - band);
    ImageView bgr{};
    if (frame != nullptr) {
      bgr = as_bgr(window_of(*frame, left, band, painting.x_px + painting.width_px - left, rows), memory);
    }
    for (int y = std::max(band, painting.y_px); y < band + rows; ++y) {
      const uint8_t* pixels = frame == nullptr ? nullptr
                                               : bgr.planes[0].data + size_t(y - band) * bgr.planes[0].stride_bytes +
                                                     3 * size_t(painting.x_px - left);
      const uint8_t* parts = planes.part.data() + size_t(y) * size_t(planes.width_px) + painting.x_px;
      paint_row(palette, parts, pixels, painting.width_px, step, first + size_t(y - painting.y_px) * stride_bytes);
    }
  }
}

}  // namespace maq
