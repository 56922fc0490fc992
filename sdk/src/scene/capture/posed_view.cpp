#include "scene/capture/posed_view.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "image/convert.h"
#include "image/geometry/resize.h"
#include "image/geometry/undistort.h"

namespace maq {

void PosedView::load(const CaptureView& view, int long_side_px) {
  load_view(view, whole_, valid_);
  camera_ = view.camera;
  image_ = &whole_.image;
  shrink_to(long_side_px);
}

void PosedView::load(const ImageView& image, const Lens& lens, const PinholeCamera& pose, int long_side_px) {
  if (image.width_px != lens.width_px || image.height_px != lens.height_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The photo has ", image.width_px, " x ", image.height_px,
                " pixels, but its camera is for ", lens.width_px, " x ", lens.height_px, ".");
  }
  camera_ = pose;
  valid_.clear();
  given_ = image;
  image_ = &given_;
  if (image.format != MAQ_PIXEL_BGR8) {
    uint8_t* const pixels = whole_.allocate_bgr(image.width_px, image.height_px);
    copy_pixels(image, MAQ_PIXEL_BGR8, pixels, 0, whole_.storage.size());
    image_ = &whole_.image;
  }
  if (lens.distortion != Distortion::kNone) {
    const std::optional<Lens> straight = without_distortion(lens);
    if (!straight) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT,
                  "The camera's distortion is not invertible within its picture; check its coefficients.");
    }
    undistort(*image_, lens, *straight, smaller_, valid_);
    std::swap(whole_, smaller_);
    image_ = &whole_.image;
    camera_.intrinsics() = straight->intrinsics();
  }
  shrink_to(long_side_px);
}

void PosedView::hide_black(const ImageView& mask) {
  if (mask.width_px != camera_.width_px || mask.height_px != camera_.height_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The mask has ", mask.width_px, " x ", mask.height_px,
                " pixels, but its photo has ", camera_.width_px, " x ", camera_.height_px, ".");
  }
  const size_t width = size_t(mask.width_px);
  if (valid_.empty()) valid_.assign(width * size_t(mask.height_px), 255);
  for (size_t i = 0; i < valid_.size(); ++i) {
    if (mask.planes[0].data[i / width * mask.planes[0].stride_bytes + i % width * 3 + 1] < 128) valid_[i] = 0;
  }
}

void PosedView::shrink_to(int long_side_px) {
  const int long_side = std::max(camera_.width_px, camera_.height_px);
  if (long_side_px == 0 || long_side <= long_side_px) return;
  const auto side = [&](int px) { return std::max(1, int(std::nearbyint(double(px) * long_side_px / long_side))); };
  const int width = side(camera_.width_px), height = side(camera_.height_px);
  shrink(*image_, width, height, smaller_);
  if (!valid_.empty()) shrink_valid(valid_, camera_.width_px, camera_.height_px, width, height);
  camera_ = resized(camera_, width, height);
  image_ = &smaller_.image;
}

}  // namespace maq
