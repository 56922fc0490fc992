#include "image/files/image_file.h"
#include "image/geometry/resize.h"
#include "sources/files/file_sources.h"

namespace maq {
namespace {

class ImageSource : public Source {
 public:
  explicit ImageSource(SourceUri uri) {
    uri.expect_no_more_options("size and fps");
    read_image_file(uri.target, image_);
    if (uri.width_px > 0) {
      Frame resized;
      resize_to_bgr(image_.image, uri.width_px, uri.height_px, resized);
      image_ = std::move(resized);
    }
    info_.width_px = image_.image.width_px;
    info_.height_px = image_.image.height_px;
    info_.frame_count = 1;
  }

  const SourceInfo& info() const override { return info_; }

  NextFrame next(int64_t, Frame& frame) override {
    if (delivered_) return NextFrame::kEnd;
    frame = std::move(image_);
    delivered_ = true;
    return NextFrame::kFrame;
  }

 private:
  Frame image_;
  SourceInfo info_;
  bool delivered_ = false;
};

}  // namespace

std::unique_ptr<Source> open_image_source(SourceUri uri) { return std::make_unique<ImageSource>(std::move(uri)); }

}  // namespace maq
