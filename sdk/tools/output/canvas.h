// An image that commands draw on: BGR of 8 bits, rows without padding. Lines have smooth edges.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

using Bgr = std::array<uint8_t, 3>;

struct PictureSide {
  int width = 0, height = 0;
  bool operator==(const PictureSide& other) const { return width == other.width && height == other.height; }
  bool operator!=(const PictureSide& other) const { return !(*this == other); }
};

struct CanvasPoint {
  double x = 0, y = 0;  // (0, 0) is the middle of the first pixel
};

class Canvas {
 public:
  Canvas() = default;
  explicit Canvas(PictureSide size, Bgr colour = {});

  bool empty() const { return bgr.empty(); }
  PictureSide size() const { return size_; }
  int width() const { return size_.width; }
  int height() const { return size_.height; }
  uint8_t* at(int x, int y) { return bgr.data() + 3 * (size_t(y) * size_t(size_.width) + size_t(x)); }
  const uint8_t* at(int x, int y) const { return const_cast<Canvas*>(this)->at(x, y); }

  // Everything outside of the image is left out.
  void mix(int x, int y, Bgr colour, float amount);
  void fill(int x, int y, PictureSide size, Bgr colour);
  void line(CanvasPoint from, CanvasPoint to, double width_px, Bgr colour);
  void outline(CanvasPoint corner, CanvasPoint opposite, double width_px, Bgr colour);
  void disc(CanvasPoint middle, double radius_px, Bgr colour);
  void copy(const Canvas& from, int x, int y);

  // Text in letters of 5 x 7 points, `point_px` pixels each; without capitals but B. (x, y) is its upper left corner.
  void text(const std::string& text, int x, int y, int point_px, Bgr colour);
  static PictureSide text_size(const std::string& text, int point_px);

  // Averages where it shrinks, bilinear where it grows.
  Canvas resized(PictureSide size) const;

  std::vector<uint8_t> bgr;

 private:
  PictureSide size_;
};

// A plane of floats.
struct FloatPlane {
  FloatPlane() = default;
  explicit FloatPlane(PictureSide of) : size(of), values(size_t(of.width) * size_t(of.height)) {}
  float& at(int x, int y) { return values[size_t(y) * size_t(size.width) + size_t(x)]; }
  float at(int x, int y) const { return values[size_t(y) * size_t(size.width) + size_t(x)]; }
  // Bilinear, with half-pixel centres.
  FloatPlane resized(PictureSide to) const;
  void blur(double sigma_px);

  PictureSide size;
  std::vector<float> values;
};
