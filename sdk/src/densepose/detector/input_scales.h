// Two sizes of the networks' input: near people are found at the smaller size, far people at the larger one.
#pragma once

#include <cstdint>
#include <vector>

#include "densepose/detector/box.h"

namespace maq {

// Decides which sizes each key frame needs. A still image gets the larger size too if its smaller size shows small
// people or nobody. A stream stays at the larger size alone while it shows small people and no large ones.
class InputScales {
 public:
  // `near_side_px`: long side of the smaller input.
  explicit InputScales(int near_side_px) : near_side_px_(near_side_px) {}

  // Whether the next image is a frame of a stream; at first it is a still image.
  void set_stream(bool is_stream) {
    if (!is_stream) reset();
    is_stream_ = is_stream;
  }

  // Returns the long side of the larger input. Returns 0 if the image has too few pixels for it, or if no person of
  // `min_person_px` pixels in the image is small in the smaller input.
  int far_side_px(int image_long_side_px, int min_person_px) const;

  // At the begin of a key frame: whether the smaller input runs. If not, the larger input runs alone.
  bool runs_near() const { return !is_far_ || checks_near_; }
  // After the smaller input: whether the larger one runs as well. `people` are in its pixels.
  bool runs_far(const std::vector<ScoredBox>& people);
  // After a key frame that ran the larger input; counts for streams only. `people`: everybody in the frame, in pixels
  // of the smaller input.
  void judge(const std::vector<ScoredBox>& people, bool ran_near);
  // The next image begins another stream.
  void reset();

 private:
  int near_side_px_;
  bool is_stream_ = false;
  bool is_far_ = false;       // the stream stays at the larger input
  bool checks_near_ = false;  // the next key frame runs both
  int empty_frames_ = 0;      // in a row, at the smaller input
  int far_frames_ = 0;        // in a row, at the larger input alone
};

// Selects the people of two inputs of one image. A person found in both keeps the larger input's box if the person is
// small in the smaller input, and the smaller input's box otherwise. People whom the larger input alone shows are kept
// if they are small and no part of a larger person. `to_near`: pixels of the smaller input in one of the larger.
// Writes 1 to keep and 0 to drop, for each box.
void select_people(const std::vector<ScoredBox>& near_people, const std::vector<ScoredBox>& far_people, float to_near,
                   std::vector<uint8_t>& keeps_near, std::vector<uint8_t>& keeps_far);

}  // namespace maq
