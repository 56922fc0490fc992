// Results on a window of Android: the frame, and its people over it.
#pragma once

#include <mutex>

#include "graphics/ndk_graphics.h"
#include "maquette/maquette.h"

namespace maq_jni {

// Where a picture has other sides than the window: all of it, between black bars, or its middle, which fills the
// window.
enum class Scaling { kFit, kFill };

struct PreviewStyle {
  Scaling scaling = Scaling::kFit;
  int opacity = 180;  // 0 to 255, of the people
  bool is_mirrored = false;
};

// A window that comes, changes its size and goes while other threads draw. Its buffers have the pixels of the frame,
// and Android's compositor scales them to the window.
class Preview {
 public:
  explicit Preview(const GraphicsFunctions& android) : android_(android) {}
  ~Preview() { set_window(nullptr, 0, 0); }
  Preview(const Preview&) = delete;
  Preview& operator=(const Preview&) = delete;

  // Takes over a reference to the window, whose size on the display is given; null: there is none any longer. Waits for
  // a drawing that runs: when it returns, no thread uses the window before.
  void set_window(ANativeWindow* window, int width_px, int height_px);

  // False where there is no window, or it takes no picture now: Android has taken it away already, or another buffer
  // came than was asked for. Throws what maq_densepose_result_draw returns.
  bool draw(const maq_frame* frame, const maq_densepose_result* result, const PreviewStyle& style);

 private:
  const GraphicsFunctions& android_;
  std::mutex mutex_;  // of all that follows, while it is drawn on too
  ANativeWindow* window_ = nullptr;
  int width_px_ = 0, height_px_ = 0;
  int buffer_width_px_ = 0, buffer_height_px_ = 0;  // as set; 0: not yet
};

}  // namespace maq_jni
