// Draws the novelty of a frame: its map, its reconstruction, and the curve over time.
#pragma once

#include <deque>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <vector>

class NoveltyImage {
 public:
  // Returns a BGR image: the frame with novel cells in red, its reconstruction, and below them the bits of all frames
  // with their events. All images have the size of the first.
  cv::Mat draw(const maquette::Frame& frame, const maquette::Frame& reconstruction, const maq_novelty_score& score,
               const std::vector<float>& map);

 private:
  void draw_curve(cv::Mat& strip) const;

  cv::Size half_;  // of the frame and of its reconstruction
  std::deque<maq_novelty_score> scores_;
};
