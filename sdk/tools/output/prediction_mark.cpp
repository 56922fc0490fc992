#include "output/prediction_mark.h"

#include <algorithm>
#include <cstdio>

namespace {

constexpr Bgr kMarkColour = {255, 0, 255};  // magenta: rare in images
constexpr int kMinSideOfText_px = 100;

}  // namespace

void draw_caption(const std::string& text, Canvas& image) {
  if (image.width() < kMinSideOfText_px) return;
  const int point_px = std::max(1, image.height() / 360);
  const PictureSide size = Canvas::text_size(text, point_px);
  image.fill(0, 0, {size.width + 12, size.height + 10}, {});
  image.text(text, 6, 5, point_px, {255, 255, 255});
}

void draw_prediction_mark(const maquette::Frame& frame, Canvas& image) {
  const maq_frame_origin origin = frame.origin();
  if (origin.kind != MAQ_FRAME_PREDICTED) return;
  char text[64];
  std::snprintf(text, sizeof text, "predicted +%lld ms", (long long)(origin.horizon_ns / 1000000));
  draw_caption(text, image);
  const int width = std::max(1, std::min(image.width(), image.height()) / 60);
  image.fill(0, 0, {image.width(), width}, kMarkColour);
  image.fill(0, image.height() - width, {image.width(), width}, kMarkColour);
  image.fill(0, 0, {width, image.height()}, kMarkColour);
  image.fill(image.width() - width, 0, {width, image.height()}, kMarkColour);
}
