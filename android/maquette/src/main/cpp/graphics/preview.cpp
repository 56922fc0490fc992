#include "graphics/preview.h"

#include <algorithm>
#include <cstring>

#include "status_error.h"

namespace maq_jni {
namespace {

// The buffers of a window, and the frame in them.
struct Layout {
  int buffer_width, buffer_height;
  int from_x, from_y, width, height;  // the part of the frame that is shown
  int to_x, to_y;                     // its left upper corner in the buffer
};

// In proportion to the window; a window that is a mere line gets no buffer without end.
constexpr int kMaxBarsPerSide = 8;

Layout layout_of(int frame_width, int frame_height, int window_width, int window_height, Scaling scaling) {
  const int64_t across = int64_t(frame_height) * window_width, down = int64_t(frame_width) * window_height;
  const bool is_wider = across > down;  // the window, than the frame
  const auto divided = [](int64_t sum, int64_t by) { return (sum + by / 2) / by; };
  Layout layout{frame_width, frame_height, 0, 0, frame_width, frame_height, 0, 0};
  if (scaling == Scaling::kFill) {
    if (is_wider) {
      layout.height = int(std::max<int64_t>(1, divided(down, window_width)));
      layout.from_y = (frame_height - layout.height) / 2;
    } else {
      layout.width = int(std::max<int64_t>(1, divided(across, window_height)));
      layout.from_x = (frame_width - layout.width) / 2;
    }
    layout.buffer_width = layout.width;
    layout.buffer_height = layout.height;
    return layout;
  }
  if (is_wider) {
    const int64_t wide = divided(across, window_height);
    layout.buffer_width = int(std::min<int64_t>(wide, int64_t(frame_width) * kMaxBarsPerSide));
  } else {
    const int64_t tall = divided(down, window_width);
    layout.buffer_height = int(std::min<int64_t>(tall, int64_t(frame_height) * kMaxBarsPerSide));
  }
  layout.to_x = (layout.buffer_width - frame_width) / 2;
  layout.to_y = (layout.buffer_height - frame_height) / 2;
  return layout;
}

void paint_black(const ANativeWindow_Buffer& buffer, int x, int y, int width, int height) {
  const uint8_t black[4] = {0, 0, 0, 255};
  uint32_t pixel;
  std::memcpy(&pixel, black, sizeof pixel);
  for (int row = y; row < y + height; ++row) {
    std::fill_n(static_cast<uint32_t*>(buffer.bits) + size_t(row) * size_t(buffer.stride) + x, width, pixel);
  }
}

void paint_bars(const ANativeWindow_Buffer& buffer, const Layout& layout) {
  const int right = layout.to_x + layout.width, bottom = layout.to_y + layout.height;
  paint_black(buffer, 0, 0, buffer.width, layout.to_y);
  paint_black(buffer, 0, bottom, buffer.width, buffer.height - bottom);
  paint_black(buffer, 0, layout.to_y, layout.to_x, layout.height);
  paint_black(buffer, right, layout.to_y, buffer.width - right, layout.height);
}

}  // namespace

void Preview::set_window(ANativeWindow* window, int width_px, int height_px) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (window_ != nullptr) android_.ANativeWindow_release(window_);
  window_ = window;
  width_px_ = width_px;
  height_px_ = height_px;
  buffer_width_px_ = buffer_height_px_ = 0;
}

bool Preview::draw(const maq_frame* frame, const maq_densepose_result* result, const PreviewStyle& style) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (window_ == nullptr || width_px_ < 1 || height_px_ < 1) return false;
  int32_t frame_width = 0, frame_height = 0;
  check(maq_densepose_result_get_size(result, &frame_width, &frame_height));
  const Layout layout = layout_of(frame_width, frame_height, width_px_, height_px_, style.scaling);
  if (layout.buffer_width != buffer_width_px_ || layout.buffer_height != buffer_height_px_) {
    if (android_.ANativeWindow_setBuffersGeometry(window_, layout.buffer_width, layout.buffer_height,
                                                  WINDOW_FORMAT_RGBA_8888) != 0) {
      return false;
    }
    buffer_width_px_ = layout.buffer_width;
    buffer_height_px_ = layout.buffer_height;
  }
  ANativeWindow_Buffer buffer{};
  if (android_.ANativeWindow_lock(window_, &buffer, nullptr) != 0) return false;
  maq_status status = MAQ_OK;
  const bool fits = buffer.bits != nullptr && buffer.width == layout.buffer_width &&
                    buffer.height == layout.buffer_height && buffer.stride >= buffer.width &&
                    buffer.format == WINDOW_FORMAT_RGBA_8888;
  if (fits) {
    maq_densepose_drawing drawing;
    maq_densepose_drawing_init(&drawing, sizeof drawing);
    drawing.x_px = layout.from_x;
    drawing.y_px = layout.from_y;
    drawing.width_px = layout.width;
    drawing.height_px = layout.height;
    drawing.opacity = style.opacity == 0 ? MAQ_DENSEPOSE_INVISIBLE : style.opacity;
    drawing.is_mirrored = style.is_mirrored ? 1 : 0;
    const size_t stride = size_t(buffer.stride) * 4;
    uint8_t* const first = static_cast<uint8_t*>(buffer.bits) + size_t(layout.to_y) * stride + size_t(layout.to_x) * 4;
    status = maq_densepose_result_draw(result, frame, &drawing, first, stride, stride * size_t(layout.height));
    paint_bars(buffer, layout);
  } else {
    buffer_width_px_ = buffer_height_px_ = 0;  // is asked for again
  }
  // Also what could not be drawn: a buffer that stays locked stops the window.
  const bool is_posted = android_.ANativeWindow_unlockAndPost(window_) == 0;
  check(status);
  return fits && is_posted;
}

}  // namespace maq_jni
