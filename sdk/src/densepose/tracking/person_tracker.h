// Ids of the people of a stream: each person keeps one while seen, and gets it again when recognised later.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "densepose/detector/box.h"
#include "densepose/surface/dense_decode.h"
#include "densepose/tracking/assignment.h"
#include "densepose/tracking/surface_colours.h"

namespace maq {

// A person is recognised by place and motion while seen and for a second after, with the colours of the body surface
// beside them; later by the colours alone: in the first frame, or when the person was seen for some time. So a person
// who comes back may have another id for that time. No two people of a stream get one id at the same time.
class PersonTracker {
 public:
  // `max_people`: of a frame.
  explicit PersonTracker(size_t max_people);

  // Gives ids, 1 or more, to the people of the next frame. `boxes`: in pixels of the image, in the order of `planes`.
  // `time_ns`: of the frame; without it, a thirtieth of a second has passed. Where time goes back or jumps by more
  // than two seconds, only colours tell who is who. The ids are valid until the next call.
  const std::vector<int64_t>& update(const ImageView& image, const DensePlanes& planes, const std::vector<Box>& boxes,
                                     std::optional<int64_t> time_ns);

  // The next frame begins another stream: nobody is recognised, and new people get ids above `last_id`.
  void begin_stream(int64_t last_id = 0);

  // The largest id that was given, 0 for none.
  int64_t last_id() const { return last_id_; }

 private:
  struct Track {
    int64_t id = 0;
    Box box;
    float velocity_x = 0, velocity_y = 0;  // of the box's centre, pixels a second
    int64_t seen_ns = 0;
    int64_t begun_ns = 0;
    int64_t seen_frame = 0, begun_frame = 0;
    bool is_new = true;     // was not compared yet with people who left
    bool has_place = true;  // of this run of frames, so that place and motion count
    SurfaceColours colours;
  };

  // Since a track of this run of frames was seen.
  double seconds_since(const Track& track) const;
  void move_time(const ImageView& image, std::optional<int64_t> time_ns);
  void recognise_by_place(const std::vector<Box>& boxes);
  void recognise_by_colours(const std::vector<Box>& boxes);
  // For people who came some time ago: whether they were here before.
  void recognise_new(const std::vector<Box>& boxes);
  // Returns the track of somebody who left and looks like `colours`, clearly more than all others do; -1 for none.
  // `is_candidate(track)`: whether it may be the person.
  template <class IsCandidate>
  int nearest_away(const SurfaceColours& colours, float max_distance, const IsCandidate& is_candidate,
                   float* distance) const;
  // Whether a person could have come there from the track's last place.
  bool is_reachable(const Track& track, const Box& box) const;
  void take_over(Track& track, size_t person, const std::vector<Box>& boxes);
  void start(size_t person, const Box& box);
  void forget_oldest();

  size_t max_tracks_;
  int64_t last_id_ = 0;
  int64_t now_ns_ = 0;
  int64_t frame_ = 0;
  bool is_begun_ = false;
  int width_px_ = 0, height_px_ = 0;
  std::vector<Track> tracks_;
  // Scratch of a frame.
  Assignment assignment_;
  std::vector<float> costs_;
  std::vector<SurfaceColours> colours_;
  std::vector<int> track_of_;   // of each person of the frame; -1: not known yet
  std::vector<char> is_taken_;  // of each track
  std::vector<int64_t> ids_;
};

}  // namespace maq
