#include "output/canvas.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace {

struct Glyph {
  char letter;
  uint8_t rows[9];  // 5 bits each; the last two are below the line
};
constexpr Glyph kGlyphs[] = {
    {'0', {14, 17, 19, 21, 25, 17, 14}},
    {'1', {4, 12, 4, 4, 4, 4, 14}},
    {'2', {14, 17, 1, 2, 4, 8, 31}},
    {'3', {31, 2, 4, 2, 1, 17, 14}},
    {'4', {2, 6, 10, 18, 31, 2, 2}},
    {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},
    {'7', {31, 1, 2, 4, 8, 8, 8}},
    {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 15, 1, 2, 12}},
    {'a', {0, 0, 14, 1, 15, 17, 15}},
    {'b', {16, 16, 22, 25, 17, 17, 30}},
    {'c', {0, 0, 14, 16, 16, 17, 14}},
    {'d', {1, 1, 13, 19, 17, 17, 15}},
    {'e', {0, 0, 14, 17, 31, 16, 14}},
    {'f', {6, 9, 8, 28, 8, 8, 8}},
    {'g', {0, 0, 15, 17, 17, 17, 15, 1, 14}},
    {'h', {16, 16, 22, 25, 17, 17, 17}},
    {'i', {4, 0, 12, 4, 4, 4, 14}},
    {'j', {2, 0, 6, 2, 2, 2, 2, 18, 12}},
    {'k', {16, 16, 18, 20, 24, 20, 18}},
    {'l', {12, 4, 4, 4, 4, 4, 14}},
    {'m', {0, 0, 26, 21, 21, 17, 17}},
    {'n', {0, 0, 22, 25, 17, 17, 17}},
    {'o', {0, 0, 14, 17, 17, 17, 14}},
    {'p', {0, 0, 30, 17, 17, 17, 30, 16, 16}},
    {'q', {0, 0, 15, 17, 17, 17, 15, 1, 1}},
    {'r', {0, 0, 22, 25, 16, 16, 16}},
    {'s', {0, 0, 14, 16, 14, 1, 30}},
    {'t', {8, 8, 28, 8, 8, 9, 6}},
    {'u', {0, 0, 17, 17, 17, 19, 13}},
    {'v', {0, 0, 17, 17, 17, 10, 4}},
    {'w', {0, 0, 17, 17, 21, 21, 10}},
    {'x', {0, 0, 17, 10, 4, 10, 17}},
    {'y', {0, 0, 17, 17, 17, 17, 15, 1, 14}},
    {'z', {0, 0, 31, 2, 4, 8, 31}},
    {'B', {30, 17, 17, 30, 17, 17, 30}},
    {'.', {0, 0, 0, 0, 0, 12, 12}},
    {',', {0, 0, 0, 0, 0, 12, 4, 8}},
    {':', {0, 12, 12, 0, 12, 12}},
    {'+', {0, 4, 4, 31, 4, 4}},
    {'#', {10, 10, 31, 10, 31, 10, 10}},
    {'-', {0, 0, 0, 31}},
};
constexpr int kGlyphColumns = 5, kGlyphRows = 9, kStep = 6;

// From where in `from` pixels the pixels of a row of `to` are read, bilinear.
struct Tap {
  int first, second;
  float weight;  // of the second
};
std::vector<Tap> taps_of(int from, int to) {
  std::vector<Tap> taps(static_cast<size_t>(to));
  for (int i = 0; i < to; ++i) {
    const float at = std::clamp((float(i) + 0.5f) * float(from) / float(to) - 0.5f, 0.0f, float(from - 1));
    const int first = int(at);
    taps[size_t(i)] = {first, std::min(first + 1, from - 1), at - float(first)};
  }
  return taps;
}

uint8_t byte_of(float value) { return uint8_t(std::clamp(value + 0.5f, 0.0f, 255.0f)); }

}  // namespace

Canvas::Canvas(PictureSide size, Bgr colour) : bgr(3 * size_t(size.width) * size_t(size.height)), size_(size) {
  fill(0, 0, size, colour);
}

void Canvas::mix(int x, int y, Bgr colour, float amount) {
  if (x < 0 || y < 0 || x >= size_.width || y >= size_.height) return;
  uint8_t* const pixel = at(x, y);
  for (size_t c = 0; c < 3; ++c) pixel[c] = byte_of(float(pixel[c]) + (float(colour[c]) - float(pixel[c])) * amount);
}

void Canvas::fill(int x, int y, PictureSide size, Bgr colour) {
  for (int row = std::max(y, 0); row < std::min(y + size.height, size_.height); ++row) {
    for (int column = std::max(x, 0); column < std::min(x + size.width, size_.width); ++column) {
      std::copy(colour.begin(), colour.end(), at(column, row));
    }
  }
}

void Canvas::line(CanvasPoint from, CanvasPoint to, double width_px, Bgr colour) {
  const double reach = 0.5 * width_px + 0.5, dx = to.x - from.x, dy = to.y - from.y;
  const double length2 = std::max(dx * dx + dy * dy, 1e-12);
  const auto inside = [](double value, int side) { return int(std::clamp(value, -1.0, double(side))); };
  const int top = std::max(inside(std::floor(std::min(from.y, to.y) - reach), size_.height), 0);
  const int bottom = inside(std::ceil(std::max(from.y, to.y) + reach), size_.height - 1);
  for (int y = top; y <= bottom; ++y) {
    // Pixels of the row that the line can reach.
    double left = std::min(from.x, to.x), right = std::max(from.x, to.x);
    if (std::abs(dy) > 1e-9) {
      const double a = from.x + dx * std::clamp((y - reach - from.y) / dy, 0.0, 1.0);
      const double b = from.x + dx * std::clamp((y + reach - from.y) / dy, 0.0, 1.0);
      left = std::min(a, b);
      right = std::max(a, b);
    }
    const double slack = reach * (1 + (std::abs(dy) > 1e-9 ? std::min(std::abs(dx / dy), 1.0) : 0));
    const int first = std::max(inside(std::floor(left - slack), size_.width), 0);
    const int last = inside(std::ceil(right + slack), size_.width - 1);
    for (int x = first; x <= last; ++x) {
      const double along = std::clamp(((x - from.x) * dx + (y - from.y) * dy) / length2, 0.0, 1.0);
      const double off_x = from.x + along * dx - x, off_y = from.y + along * dy - y;
      const double amount = reach - std::sqrt(off_x * off_x + off_y * off_y);
      if (amount > 0) mix(x, y, colour, float(std::min(amount, 1.0)));
    }
  }
}

void Canvas::outline(CanvasPoint corner, CanvasPoint opposite, double width_px, Bgr colour) {
  const CanvasPoint beside{opposite.x, corner.y}, below{corner.x, opposite.y};
  line(corner, beside, width_px, colour);
  line(beside, opposite, width_px, colour);
  line(opposite, below, width_px, colour);
  line(below, corner, width_px, colour);
}

void Canvas::disc(CanvasPoint middle, double radius_px, Bgr colour) { line(middle, middle, 2 * radius_px, colour); }

void Canvas::copy(const Canvas& from, int x, int y) {
  for (int row = 0; row < from.height(); ++row) {
    std::copy_n(from.at(0, row), 3 * size_t(from.width()), at(x, y + row));
  }
}

PictureSide Canvas::text_size(const std::string& text, int point_px) {
  return {(kStep * int(text.size()) - 1) * point_px, 7 * point_px};
}

void Canvas::text(const std::string& text, int x, int y, int point_px, Bgr colour) {
  for (const char letter : text) {
    const auto* glyph =
        std::find_if(std::begin(kGlyphs), std::end(kGlyphs), [&](const Glyph& one) { return one.letter == letter; });
    for (int row = 0; glyph != std::end(kGlyphs) && row < kGlyphRows; ++row) {
      for (int column = 0; column < kGlyphColumns; ++column) {
        if ((glyph->rows[row] >> (kGlyphColumns - 1 - column) & 1) == 0) continue;
        fill(x + column * point_px, y + row * point_px, {point_px, point_px}, colour);
      }
    }
    x += kStep * point_px;
  }
}

Canvas Canvas::resized(PictureSide size) const {
  if (size == size_) return *this;
  Canvas made(size);
  if (size.width > size_.width || size.height > size_.height) {
    const std::vector<Tap> columns = taps_of(size_.width, size.width), rows = taps_of(size_.height, size.height);
    for (int y = 0; y < size.height; ++y) {
      const Tap& row = rows[size_t(y)];
      for (int x = 0; x < size.width; ++x) {
        const Tap& column = columns[size_t(x)];
        for (int c = 0; c < 3; ++c) {
          const auto across = [&](int source) {
            const float left = at(column.first, source)[c], right = at(column.second, source)[c];
            return left + (right - left) * column.weight;
          };
          const float above = across(row.first);
          made.at(x, y)[c] = byte_of(above + (across(row.second) - above) * row.weight);
        }
      }
    }
    return made;
  }
  for (int y = 0; y < size.height; ++y) {
    const int top = int(int64_t(y) * size_.height / size.height);
    const int bottom = std::max(top + 1, int(int64_t(y + 1) * size_.height / size.height));
    for (int x = 0; x < size.width; ++x) {
      const int left = int(int64_t(x) * size_.width / size.width);
      const int right = std::max(left + 1, int(int64_t(x + 1) * size_.width / size.width));
      std::array<int64_t, 3> sums{};
      for (int row = top; row < bottom; ++row) {
        for (int column = left; column < right; ++column) {
          for (size_t c = 0; c < 3; ++c) sums[c] += at(column, row)[c];
        }
      }
      const int64_t count = int64_t(bottom - top) * (right - left);
      for (size_t c = 0; c < 3; ++c) made.at(x, y)[c] = uint8_t((sums[c] + count / 2) / count);
    }
  }
  return made;
}

FloatPlane FloatPlane::resized(PictureSide to) const {
  FloatPlane made(to);
  const std::vector<Tap> columns = taps_of(size.width, to.width), rows = taps_of(size.height, to.height);
  for (int y = 0; y < to.height; ++y) {
    const Tap& row = rows[size_t(y)];
    for (int x = 0; x < to.width; ++x) {
      const Tap& column = columns[size_t(x)];
      const auto across = [&](int source) {
        const float left = at(column.first, source);
        return left + (at(column.second, source) - left) * column.weight;
      };
      const float above = across(row.first);
      made.at(x, y) = above + (across(row.second) - above) * row.weight;
    }
  }
  return made;
}

void FloatPlane::blur(double sigma_px) {
  const int reach = std::max(1, int(std::lround(4 * sigma_px)));
  std::vector<float> weights(size_t(2 * reach + 1));
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    weights[size_t(i + reach)] = float(std::exp(-0.5 * i * i / (sigma_px * sigma_px)));
    sum += weights[size_t(i + reach)];
  }
  for (float& weight : weights) weight /= sum;
  // Rows, then columns; the border is repeated.
  const int width = size.width, height = size.height;
  std::vector<float> padded(size_t(width + 2 * reach)), row(static_cast<size_t>(width));
  for (int y = 0; y < height; ++y) {
    float* const from = values.data() + size_t(y) * size_t(width);
    for (int x = -reach; x < width + reach; ++x) padded[size_t(x + reach)] = from[std::clamp(x, 0, width - 1)];
    std::fill(row.begin(), row.end(), 0.0f);
    for (size_t k = 0; k < weights.size(); ++k) {
      for (int x = 0; x < width; ++x) row[size_t(x)] += weights[k] * padded[size_t(x) + k];
    }
    std::copy(row.begin(), row.end(), from);
  }
  const std::vector<float> from = values;
  for (int y = 0; y < height; ++y) {
    float* const to = values.data() + size_t(y) * size_t(width);
    std::fill_n(to, width, 0.0f);
    for (int k = -reach; k <= reach; ++k) {
      const float* const source = from.data() + size_t(std::clamp(y + k, 0, height - 1)) * size_t(width);
      for (int x = 0; x < width; ++x) to[x] += weights[size_t(k + reach)] * source[x];
    }
  }
}
