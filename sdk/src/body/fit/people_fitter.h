// Bodies of the people of a stream: each fit begins at the person's body in the frame before, and the shape is one for
// all frames.
#pragma once

#include <cstdint>
#include <vector>

#include "body/fit/body_fitter.h"

namespace maq::body {

struct PersonRequest {
  uint8_t number = 0;                // in the person plane
  int64_t id = 0;                    // 0: unknown, so that the person has no earlier frames
  const float* keypoints = nullptr;  // [33][3], null for none
  double height_m = 0;               // 0: unknown
};

class PeopleFitter {
 public:
  static constexpr size_t kMaxTracks = 64;

  // `model` must outlive this.
  explicit PeopleFitter(const BodyModel& model, const FitSettings& settings = {});

  // Begins a frame: counts its pixels, and forgets people who were last seen more than a second before, or all if the
  // time goes back. The image must live until the last fit() of the frame.
  void begin_frame(const LabelImage& image, const BodyCamera& camera, int64_t timestamp_ns);

  FittedBody fit(const PersonRequest& person);

  // Begins another stream.
  void reset() { tracks_.clear(); }

 private:
  struct Track {
    int64_t id = 0, seen_ns = 0;
    BodyPose pose;
    bool is_perspective = false;
    std::array<double, kMaxShapes> shape{};  // running mean
    double frames = 0, noise = 0;
  };
  Track* find_track(int64_t id);
  void keep(int64_t id, const FittedBody& body);

  const BodyModel& model_;
  BodyFitter fitter_;
  LabelImage image_;
  BodyCamera camera_;
  int64_t now_ns_ = 0;
  PeoplePixels people_{};
  Observations seen_;
  std::vector<Track> tracks_;
};

}  // namespace maq::body
