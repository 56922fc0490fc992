// Runs without a user: when they end, and what they report.
#pragma once

#include <string>
#include <vector>

#include "options.h"
#include "window.h"

class PeopleView;
class SceneView;

class HeadlessRun {
 public:
  explicit HeadlessRun(const Options& options) : frames_(options.frames), start_s_(monotonic_s()) {}

  void add_frame(double begin_s);  // that is on the screen now
  bool is_done(const PeopleView& people) const;
  bool is_done(SceneView& scene);  // looks around in it, and ends where a photo was taken
  // Why it has failed, a sentence; "" when it has not.
  std::string failure(const PeopleView& people) const;
  std::string failure(const SceneView& scene) const;
  // One line of JSON. `scene`: null while people are shown.
  std::string report(const PeopleView& people, const SceneView* scene, const Window& window) const;

 private:
  const uint64_t frames_;
  const double start_s_;
  double start_ms_ = 0;  // to the first frame on the screen
  std::vector<float> frame_ms_;
  uint64_t done_images_ = 0;
};
