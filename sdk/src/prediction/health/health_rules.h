// Decides from measures of the frames what happened to a camera.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/health/picture_match.h"

namespace maq {

enum class CameraEvent { kNone, kCut, kFreeze, kBlack, kCovered, kMoved, kObject };

struct HealthResult {
  CameraEvent event = CameraEvent::kNone;  // found with this frame
  CameraEvent state = CameraEvent::kNone;  // what lasts: kFreeze, kBlack or kCovered
  int64_t began_ns = 0;                    // of the event: the time of its first frame
  bool is_stream_start = false;
  float unexplained = 0;             // fraction of the frame that motion does not explain
  float object_x = 0, object_y = 0;  // kObject: its middle, in fractions of width and height
  float shift_x = 0, shift_y = 0;    // kMoved: the motion of the picture, in fractions of the width
};

// The brightness of a picture, in grey levels.
struct PictureBrightness {
  float brightest = 0, deviation = 0;
};

// For one stream. A disturbance begins where a picture shows what nothing explains, or jumps. It ends when the picture
// has rested for some frames; then the picture before it and the picture now tell what happened.
class HealthRules {
 public:
  // Forgets the stream; the next frame is its first.
  void reset();

  // Judges the stream's next frame by its picture and the picture before. `match`: one in the other. `is_equal`: every
  // byte is as in the frame before. Pictures are kept where they are needed later.
  HealthResult add(const SmallPicture& picture, const SmallPicture& before, const PictureMatch& match, bool is_equal,
                   const PictureBrightness& brightness, int64_t time_ns);

 private:
  static constexpr size_t kBefore = 8;  // frames that say what is usual

  bool is_disturbed(const PictureMatch& match) const;
  bool is_calm(const PictureMatch& match) const;
  float new_fraction(const PictureMatch& match) const;
  void remember(const PictureMatch& match);
  void forget_usual();
  // Returns whether the picture is black or equal ones came, and then fills the result.
  bool find_outage(bool is_equal, const PictureBrightness& brightness, int64_t time_ns, HealthResult& result);
  void begin_disturbance(const SmallPicture& before, const PictureMatch& match, int64_t time_ns);
  bool is_much_worse(const PictureMatch& match) const;
  bool is_cut(const PictureMatch& match);
  void follow_disturbance(const SmallPicture& picture, const PictureMatch& match, HealthResult& result);
  void name_event(const SmallPicture& picture, const PictureMatch& match, HealthResult& result);
  bool is_abrupt() const;
  bool is_covered(const PictureMatch& change) const;
  bool find_object(const PictureMatch& since_rest, HealthResult& result) const;
  bool lost_detail(float flat_fraction) const;

  bool has_frame_ = false;
  int equal_frames_ = 0;
  int64_t equal_since_ns_ = 0;
  CameraEvent state_ = CameraEvent::kNone;
  float usual_flat_fraction_ = 0;
  SmallPicture calm_;         // before a disturbance
  SmallPicture rest_;         // the first picture after it
  PictureMatch change_;       // of rest_ in calm_
  PictureMatch since_rest_;   // of a later picture in rest_
  int disturbed_frames_ = 0;  // 0: calm
  int rest_frames_ = 0;       // of these, the latest that rest
  float peak_fraction_ = 0,
        other_fraction_ = 0;  // unexplained in the first disturbed frame, and the most until the rest
  float fraction_before_ = 0, latest_fraction_ = 0;  // unexplained in the two frames before
  float peak_shift_ = 0, new_fraction_ = 0;
  int64_t disturbed_ns_ = 0;
  bool is_unsteady_ = false;  // a disturbance did not end: nothing is said until the stream is calm
  std::array<std::vector<float>, kBefore> unexplained_;  // of the latest frames, a ring
  std::array<float, kBefore> fractions_{}, shifts_{};
  size_t next_ = 0, known_ = 0;
};

}  // namespace maq
