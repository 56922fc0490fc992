// A photo ready for fitting: BGR, without distortion, no larger than asked for; its validity mask and its camera.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "image/geometry/lens.h"
#include "image/geometry/pinhole_camera.h"
#include "scene/capture/capture.h"

namespace maq {

class PosedView {
 public:
  // A capture's photo from disk. `long_side_px`: larger ones are made smaller; 0: none. Throws as load_view() does.
  void load(const CaptureView& view, int long_side_px);

  // An app's image of any format, taken with `lens`, whose image has the size of `image`; `pose` is its camera
  // without distortion. Its memory must stay while this is used. Throws MAQ_ERROR_INVALID_ARGUMENT for another size and
  // for a distortion that is not invertible, and the errors of copy_pixels().
  void load(const ImageView& image, const Lens& lens, const PinholeCamera& pose, int long_side_px);

  // Makes pixels invalid where `mask`, a BGR image of the size of image(), is darker than half.
  void hide_black(const ImageView& mask);

  const ImageView& image() const { return *image_; }
  const uint8_t* valid() const {
    return valid_.empty() ? nullptr : valid_.data();
  }  // validity mask, 0: not of the photo; null: all is
  const PinholeCamera& camera() const { return camera_; }

 private:
  void shrink_to(int long_side_px);

  Frame whole_, smaller_;
  ImageView given_;
  const ImageView* image_ = nullptr;
  std::vector<uint8_t> valid_;
  PinholeCamera camera_;
};

}  // namespace maq
