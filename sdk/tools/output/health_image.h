// Draws camera health: a frame with its unexplained cells, the curve over time, and a strip of the events.
#pragma once

#include <deque>
#include <maquette/maquette.hpp>
#include <vector>

#include "output/canvas.h"

class HealthImage {
 public:
  // Returns an image: the frame with unexplained cells in red, and below it the unexplained fraction of all frames with
  // their events. All images have the size of the first.
  Canvas draw(const maquette::Frame& frame, const maq_camera_health_result& result, const std::vector<float>& map);

 private:
  void draw_curve(Canvas& strip) const;

  PictureSide size_;  // of the frame
  std::deque<maq_camera_health_result> results_;
};

// Small images of events side by side, in rows.
class EventStrip {
 public:
  // Adds the frame of an event with its time and kind. Keeps the first 48.
  void add(const maquette::Frame& frame, double time_s, const maq_camera_health_result& result,
           const std::vector<float>& map);

  // Returns all of them as one image; one grey tile without events.
  Canvas image() const;

 private:
  std::vector<Canvas> tiles_;
};
