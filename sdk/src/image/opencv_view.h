// An image as OpenCV sees it. Only the files of src/image include this.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "core/frame.h"

namespace maq {

// The image as 8-bit BGR: of the same memory when it is BGR already, otherwise a converted copy in `memory`, which is kept
// by the caller so that the next one takes nothing from the heap.
cv::Mat as_bgr(const ImageView& image, std::vector<uint8_t>& memory);

}  // namespace maq
