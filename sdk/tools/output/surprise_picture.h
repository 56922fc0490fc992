// How surprising a frame is, drawn: where, what the network saw, and the curve over time.
#pragma once

#include <deque>
#include <maquette/maquette.hpp>
#include <opencv2/core.hpp>
#include <vector>

class SurprisePicture {
 public:
  // BGR: the frame with its surprising cells in red beside `rebuilt`, below them the bits of the frames so far with
  // their events. All of the size of the first.
  cv::Mat draw(const maquette::Frame& frame, const maquette::Frame& rebuilt, const maq_surprise_score& score,
               const std::vector<float>& map);

 private:
  void draw_curve(cv::Mat& strip) const;

  cv::Size half_;  // of the frame and of what is beside it
  std::deque<maq_surprise_score> scores_;
};
