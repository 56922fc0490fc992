#include "densepose/texture/surface_texture.h"

#include <algorithm>
#include <cmath>

#include "image/convert.h"

namespace maq {
namespace {

// Pixels after which the confidence of a texel is one half.
constexpr float kEnoughWeight = 2;
// Older pixels count less after so many, so that the texture follows a change of light.
constexpr float kMaxWeight = 60;
constexpr float kMinWeight = 0.05f;  // less than this was not seen
// Width of the outline that is left out, in pixels, for a person of kTallPx and for all others.
constexpr int kOutlinePx = 1, kTallOutlinePx = 2, kTallPx = 300;

struct PersonBounds {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

PersonBounds bounds_of(const DensePlanes& planes, uint8_t person) {
  PersonBounds bounds{planes.width_px, planes.height_px, 0, 0};
  for (int y = 0; y < planes.height_px; ++y) {
    const uint8_t* const row = planes.person.data() + size_t(y) * size_t(planes.width_px);
    for (int x = 0; x < planes.width_px; ++x) {
      if (row[x] != person) continue;
      bounds.x0 = std::min(bounds.x0, x);
      bounds.x1 = std::max(bounds.x1, x + 1);
      bounds.y0 = std::min(bounds.y0, y);
      bounds.y1 = y + 1;
    }
  }
  return bounds;
}

// Whether the pixels `reach` to the left, right, above and below, if they are in the image, show the same person.
bool is_inside(const DensePlanes& planes, int x, int y, int reach, uint8_t person) {
  const auto is_person = [&](int at_x, int at_y) {
    if (at_x < 0 || at_y < 0 || at_x >= planes.width_px || at_y >= planes.height_px) return true;
    return planes.person[size_t(at_y) * size_t(planes.width_px) + size_t(at_x)] == person;
  };
  return is_person(x - reach, y) && is_person(x + reach, y) && is_person(x, y - reach) && is_person(x, y + reach);
}

// Colours and weights of a square, premultiplied: [side][side][4].
struct Level {
  explicit Level(int of_side) : side(of_side), values(4 * size_t(of_side) * size_t(of_side)) {}
  float* at(int x, int y) { return values.data() + 4 * (size_t(y) * size_t(side) + size_t(x)); }
  int side;
  std::vector<float> values;
};

// Returns the level of half the size: sums of two by two, with a weight of at most 1.
Level halved(Level& fine) {
  Level coarse((fine.side + 1) / 2);
  for (int y = 0; y < fine.side; ++y) {
    for (int x = 0; x < fine.side; ++x) {
      const float* const from = fine.at(x, y);
      float* const to = coarse.at(x / 2, y / 2);
      for (int c = 0; c < 4; ++c) to[c] += from[c];
    }
  }
  for (size_t i = 0; i < coarse.values.size(); i += 4) {
    const float scale = 1 / std::max(1.0f, coarse.values[i + 3]);
    for (size_t c = 0; c < 4; ++c) coarse.values[i + c] *= scale;
  }
  return coarse;
}

// Fills what the fine level lacks with the colours of the coarse level, which lacks nothing.
void fill(Level& fine, Level& coarse) {
  for (int y = 0; y < fine.side; ++y) {
    for (int x = 0; x < fine.side; ++x) {
      float* const to = fine.at(x, y);
      const float* const from = coarse.at(x / 2, y / 2);
      const float missing = 1 - to[3];
      for (int c = 0; c < 4; ++c) to[c] += missing * from[c];
    }
  }
}

uint8_t as_byte(float value) { return uint8_t(std::lround(std::clamp(value, 0.0f, 255.0f))); }

}  // namespace

SurfaceTexture::SurfaceTexture(int tile_px)
    : tile_px_(tile_px), texels_(size_t(kParts) * size_t(tile_px) * size_t(tile_px)) {}

int64_t SurfaceTexture::add(const ImageView& image, const DensePlanes& planes, uint8_t person) {
  const PersonBounds bounds = bounds_of(planes, person);
  if (bounds.x1 <= bounds.x0) return 0;
  const int left = bounds.x0 / 2 * 2, top = bounds.y0 / 2 * 2;  // of YUV images two pixels share their colour
  const ImageView bgr = as_bgr(window_of(image, left, top, bounds.x1 - left, bounds.y1 - top), memory_);
  const int reach = bounds.y1 - bounds.y0 >= kTallPx ? kTallOutlinePx : kOutlinePx;
  int64_t count = 0;
  for (int y = bounds.y0; y < bounds.y1; ++y) {
    const uint8_t* const pixels = bgr.planes[0].data + size_t(y - top) * bgr.planes[0].stride_bytes;
    for (int x = bounds.x0; x < bounds.x1; ++x) {
      const size_t at = size_t(y) * size_t(planes.width_px) + size_t(x);
      const int part = planes.part[at];
      if (planes.person[at] != person || part < 1 || part > kParts) continue;
      if (!is_inside(planes, x, y, reach, person)) continue;
      add_pixel(pixels + 3 * size_t(x - left), part, float(planes.u[at]) / 255, float(planes.v[at]) / 255);
      ++count;
    }
  }
  return count;
}

void SurfaceTexture::add_pixel(const uint8_t* bgr, int part, float u, float v) {
  const float last = float(tile_px_ - 1);
  const float x = std::clamp(u * float(tile_px_) - 0.5f, 0.0f, last);
  const float y = std::clamp((1 - v) * float(tile_px_) - 0.5f, 0.0f, last);
  const int column = std::min(int(x), tile_px_ - 2), row = std::min(int(y), tile_px_ - 2);
  const float across = x - float(column), down = y - float(row);
  Texel* const corner =
      texels_.data() + (size_t(part - 1) * size_t(tile_px_) + size_t(row)) * size_t(tile_px_) + size_t(column);
  for (int k = 0; k < 4; ++k) {
    const float weight = (k % 2 != 0 ? across : 1 - across) * (k / 2 != 0 ? down : 1 - down);
    if (weight <= 0) continue;
    Texel& texel = corner[size_t(k / 2) * size_t(tile_px_) + size_t(k % 2)];
    const float total = texel.weight + weight;
    const float share = weight / total;
    for (size_t c = 0; c < 3; ++c) texel.colour[c] += (float(bgr[2 - c]) - texel.colour[c]) * share;
    texel.weight = std::min(total, kMaxWeight);
  }
}

bool SurfaceTexture::filled_tile(const Texel* tile, std::vector<float>& colours) const {
  std::vector<Level> levels;
  levels.emplace_back(tile_px_);
  bool is_seen = false;
  for (size_t i = 0; i < size_t(tile_px_) * size_t(tile_px_); ++i) {
    const float weight = std::min(1.0f, tile[i].weight);
    if (weight < kMinWeight) continue;
    is_seen = true;
    for (size_t c = 0; c < 3; ++c) levels[0].values[4 * i + c] = weight * tile[i].colour[c];
    levels[0].values[4 * i + 3] = weight;
  }
  if (!is_seen) return false;
  while (levels.back().side > 1) {
    Level coarse = halved(levels.back());
    levels.push_back(std::move(coarse));
  }
  float* const whole = levels.back().values.data();
  for (int c = 0; c < 4; ++c) whole[c] /= whole[3];
  for (size_t i = levels.size() - 1; i > 0; --i) fill(levels[i - 1], levels[i]);
  for (size_t i = 0; i < colours.size(); ++i) colours[i] = levels[0].values[i / 3 * 4 + i % 3];
  return true;
}

void SurfaceTexture::draw(uint8_t* rgba, size_t stride_bytes) const {
  const size_t side = size_t(tile_px_);
  std::vector<float> colours(3 * side * side);
  for (size_t part = 0; part < size_t(kParts); ++part) {
    const Texel* const tile = texels_.data() + part * side * side;
    if (!filled_tile(tile, colours)) std::fill(colours.begin(), colours.end(), 128.0f);
    uint8_t* const corner = rgba + part % size_t(kRows) * side * stride_bytes + 4 * (part / size_t(kRows) * side);
    for (size_t i = 0; i < side * side; ++i) {
      uint8_t* const to = corner + i / side * stride_bytes + 4 * (i % side);
      for (size_t c = 0; c < 3; ++c) to[c] = as_byte(colours[3 * i + c]);
      const float weight = tile[i].weight;
      to[3] = weight < kMinWeight ? uint8_t(0) : as_byte(255 * weight / (weight + kEnoughWeight));
    }
  }
}

}  // namespace maq
