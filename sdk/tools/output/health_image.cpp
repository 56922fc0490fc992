#include "output/health_image.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "output/frame_image.h"
#include "output/prediction_mark.h"
#include "output/sampled_frames.h"

namespace {

constexpr int kMinWidth_px = 160, kMaxWidth_px = 640, kStrip_px = 64;
constexpr int kTileWidth_px = 240, kTilesInRow = 6;
constexpr size_t kMaxTiles = 48;
constexpr float kRedFrom = 0.3f, kRed = 0.8f, kMaxRed = 0.7f;  // of a cell: where red begins, and where it is full
constexpr Bgr kHealthEvent = {60, 60, 230};

FloatPlane redness_of(const maq_camera_health_result& result, const std::vector<float>& map) {
  FloatPlane cells({result.columns, result.rows});
  for (size_t i = 0; i < cells.values.size(); ++i) {
    cells.values[i] = kMaxRed * std::clamp((map[i] - kRedFrom) / (kRed - kRedFrom), 0.0f, 1.0f);
  }
  return cells;
}

PictureSide even_size(const maquette::Frame& frame, int width) {
  const maq_frame_desc desc = frame.desc();
  return {width, std::clamp(int(std::lround(double(desc.height_px) * width / desc.width_px)), 2, 2 * width) / 2 * 2};
}

Canvas reddened(const maquette::Frame& frame, PictureSide size, const maq_camera_health_result& result,
                const std::vector<float>& map) {
  Canvas image = image_of(frame).resized(size);
  if (!map.empty()) redden(redness_of(result, map), image);
  return image;
}

}  // namespace

void HealthImage::draw_curve(Canvas& strip) const {
  const double bottom = strip.height() - 1;
  strip.text("unexplained by motion", 3, 2, 1, {130, 130, 130});
  const int step = std::max(1, strip.width() / 300);
  int x = strip.width() - 1 - step * int(results_.size() - 1);
  CanvasPoint before{double(x), bottom};
  for (const maq_camera_health_result& result : results_) {
    const CanvasPoint now{double(x), (1 - double(result.unexplained)) * bottom};
    if (result.event != MAQ_CAMERA_OK) {
      strip.fill(x, 0, {1, strip.height()}, kHealthEvent);
      const std::string name = maq_camera_event_get_name(result.event);
      strip.text(name, std::max(0, x - Canvas::text_size(name, 1).width - 2), 12, 1, kHealthEvent);
    }
    strip.line(before, now, 1, {230, 230, 230});
    before = now;
    x += step;
  }
}

Canvas HealthImage::draw(const maquette::Frame& frame, const maq_camera_health_result& result,
                         const std::vector<float>& map) {
  if (size_.width == 0) {
    size_ = even_size(frame, std::clamp(frame.desc().width_px, kMinWidth_px, kMaxWidth_px) / 2 * 2);
  }
  Canvas image = reddened(frame, size_, result, map);
  const maq_camera_event shown = result.event != MAQ_CAMERA_OK ? result.event : result.state;
  draw_caption(maq_camera_event_get_name(shown), image);
  results_.push_back(result);
  while (int(results_.size()) * std::max(1, size_.width / 300) > size_.width) results_.pop_front();
  Canvas all({size_.width, size_.height + kStrip_px}), strip({size_.width, kStrip_px}, {20, 20, 20});
  draw_curve(strip);
  if (shown != MAQ_CAMERA_OK) image.outline({2, 2}, {size_.width - 3.0, size_.height - 3.0}, 5, kHealthEvent);
  all.copy(image, 0, 0);
  all.copy(strip, 0, size_.height);
  return all;
}

void EventStrip::add(const maquette::Frame& frame, double time_s, const maq_camera_health_result& result,
                     const std::vector<float>& map) {
  if (tiles_.size() == kMaxTiles) return;
  const PictureSide size = tiles_.empty() ? even_size(frame, kTileWidth_px) : tiles_.front().size();
  Canvas tile = reddened(frame, size, result, map);
  char text[64];
  std::snprintf(text, sizeof text, "%.2f s: %s", time_s, maq_camera_event_get_name(result.event));
  draw_caption(text, tile);
  tiles_.push_back(tile);
}

Canvas EventStrip::image() const {
  if (tiles_.empty()) {
    Canvas none({kTileWidth_px, kTileWidth_px * 3 / 4}, {60, 60, 60});
    draw_caption("no events", none);
    return none;
  }
  const PictureSide size = tiles_.front().size();
  const int columns = std::min(int(tiles_.size()), kTilesInRow);
  const int rows = (int(tiles_.size()) + columns - 1) / columns;
  Canvas all({columns * size.width, rows * size.height});
  for (int i = 0; i < int(tiles_.size()); ++i) {
    all.copy(tiles_[size_t(i)], i % columns * size.width, i / columns * size.height);
  }
  return all;
}
