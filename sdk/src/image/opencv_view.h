// An image as OpenCV sees it. Only the files of src/image include this.
#pragma once

#include <opencv2/core.hpp>

#include "core/frame.h"

namespace maq {

// The image as 8-bit BGR: of the same memory when it is BGR already, a converted copy otherwise.
cv::Mat as_bgr(const ImageView& image);

}  // namespace maq
