// From the logits of a person's keypoints to places and confidences.
#pragma once

#include <array>
#include <cstddef>

#include "image/crop_input.h"

namespace maq {

constexpr size_t kKeypoints = 33;

// In the order of MediaPipe Pose.
constexpr std::array<const char*, kKeypoints> kKeypointNames = {
    "nose",        "left_eye_inner",  "left_eye",         "left_eye_outer", "right_eye_inner",
    "right_eye",   "right_eye_outer", "left_ear",         "right_ear",      "mouth_left",
    "mouth_right", "left_shoulder",   "right_shoulder",   "left_elbow",     "right_elbow",
    "left_wrist",  "right_wrist",     "left_pinky",       "right_pinky",    "left_index",
    "right_index", "left_thumb",      "right_thumb",      "left_hip",       "right_hip",
    "left_knee",   "right_knee",      "left_ankle",       "right_ankle",    "left_heel",
    "right_heel",  "left_foot_index", "right_foot_index",
};

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
