// Where the content of a frame was in the frame before: block matching of brightness.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "image/crop_input.h"

namespace maq {

class FrameMotion {
 public:
  struct Motion {
    float x_px = 0, y_px = 0;  // since the frame before, in pixels of the frame
    float mismatch = 0;        // mean difference of brightness along it, 0 to 255
  };

  // Takes the next frame. Without `follows_last`, with another size or for a depth image, no motion is known.
  void next(const ImageView& image, bool follows_last);
  bool is_known() const { return is_known_; }
  // The motion of what the frame shows at a point, which may lie outside; known. A block of pixels is matched when it
  // is asked for, once.
  const Motion& at(const Point& point);

 private:
  // Brightness of a frame, reduced.
  struct Level {
    int width = 0, height = 0;
    std::vector<uint8_t> values;
  };
  struct Levels {
    Level fine, coarse;
  };
  struct Vector {
    int x = 0, y = 0;
  };

  template <int kHalf>
  class Window;

  Motion matched(int column, int row) const;

  Levels now_, before_;
  int image_width_px_ = 0, image_height_px_ = 0;
  int step_ = 1;  // pixels of the frame in a pixel of the fine level
  bool is_known_ = false;
  int columns_ = 0, rows_ = 0;
  std::vector<Motion> blocks_;
  std::vector<uint8_t> is_matched_;
};

}  // namespace maq
