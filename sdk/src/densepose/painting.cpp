#include "densepose/painting.h"

#include <algorithm>
#include <array>
#include <vector>

#include "densepose/body_parts.h"
#include "image/convert.h"

namespace maq {
namespace {

constexpr int kBandRows = 16;  // even; converted at once, in the cache

// The colours of OpenCV's COLORMAP_PARULA and COLORMAP_VIRIDIS at part * 255 / 24.
constexpr std::array<std::array<uint8_t, 3>, 25> kParulaParts = {{
    {0, 0, 0},       {37, 60, 163},   {20, 80, 194},   {4, 97, 223},   {8, 110, 221},  {14, 122, 216}, {20, 132, 212},
    {15, 144, 208},  {11, 156, 203},  {6, 166, 198},   {22, 173, 185}, {38, 179, 172}, {55, 185, 159}, {86, 187, 144},
    {114, 189, 130}, {145, 191, 116}, {170, 189, 105}, {192, 188, 96}, {216, 186, 86}, {228, 192, 74}, {240, 199, 60},
    {252, 206, 46},  {251, 220, 36},  {250, 235, 25},  {249, 251, 14},
}};
constexpr std::array<std::array<uint8_t, 3>, 25> kViridisParts = {{
    {68, 1, 84},    {71, 16, 99},   {72, 31, 112},  {71, 44, 122},  {68, 57, 131},  {64, 70, 136},  {59, 81, 139},
    {54, 93, 141},  {49, 104, 142}, {44, 113, 142}, {40, 124, 142}, {37, 133, 142}, {33, 144, 141}, {31, 154, 138},
    {32, 163, 134}, {39, 173, 129}, {53, 183, 121}, {70, 192, 111}, {92, 200, 99},  {115, 208, 86}, {142, 214, 69},
    {170, 220, 50}, {197, 224, 33}, {226, 228, 24}, {253, 231, 37},
}};

// Colour of a part: the value it adds to a channel, and the weight of the frame, both times 255.
struct Paint {
  std::array<int, 3> rgb;
  int kept;
  uint8_t alpha;
};
using Palette = std::array<Paint, kBodyParts.size()>;

Palette palette_of(const Painting& painting, bool has_frame) {
  Palette palette;
  for (size_t part = 0; part < palette.size(); ++part) {
    const int covers = part == 0 ? 0 : painting.opacity;
    const auto& rgb = painting.colours == PartColours::kDetectron2     ? kParulaParts[part]
                      : painting.colours == PartColours::kMagicAnimate ? kViridisParts[part]
                                                                       : kBodyParts[part].rgb;
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
  const Palette palette = palette_of(painting, frame != nullptr);
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
