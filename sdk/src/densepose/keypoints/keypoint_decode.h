// From the logits of a person's keypoints to places and confidences.
#pragma once

#include <array>

#include "densepose/keypoints/keypoint_names.h"
#include "image/crop_input.h"

namespace maq {

// In pixels of the image. See maq_densepose_result_get_keypoints for the confidence.
struct Keypoint {
  float x_px = 0, y_px = 0, confidence = 0;
};

using Keypoints = std::array<Keypoint, kKeypoints>;

// `logits`: [size / 2, size / 2, 2, 2, kKeypoints], cells as in DenseLogits. `to_image` maps positions of the cells to
// the image; cell (0, 0) covers [0, 1) x [0, 1). The softmax over all cells is the distribution of a keypoint. The
// keypoint is the mean of the cells around the likeliest one (of equal ones the first by rows), up to two cells away;
// its confidence is their probability. With logits that are not finite: confidence 0, in the middle of the cells.
Keypoints decode_keypoints(const float* logits, int size, const AffineMap& to_image);

}  // namespace maq
