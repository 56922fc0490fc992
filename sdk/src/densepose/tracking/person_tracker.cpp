#include "densepose/tracking/person_tracker.h"

#include <algorithm>
#include <cmath>

namespace maq {
namespace {

constexpr uint64_t kSecond_ns = 1'000'000'000, kFrame_ns = kSecond_ns / 30;
// A longer pause of the stream tells nothing about where people are.
constexpr uint64_t kLongestPause_ns = 2 * kSecond_ns;
// People who were not seen for longer are recognised by their colours alone.
constexpr double kPlaceKnown_s = 1.0;
// Motion is believed for so long.
constexpr double kMotionKnown_s = 0.3;
// A running person moves by so many of their heights in a second.
constexpr float kFastest = 3;
// How much of the newest motion is believed.
constexpr float kNewMotion = 0.4f;
// People who left and may come back.
constexpr size_t kMaxAway = 32;
// A person's box overlaps the expected one by this IoU, or its centre is nearer than this part of the box's size.
constexpr float kMinIou = 0.1f, kNear = 0.5f;
// How much the colours count beside the place, where both show the same parts of the body; and the difference from
// which on it is somebody else.
constexpr float kColourWeight = 1.3f, kOtherPerson = 0.6f;
// A person who comes back: this share of the body tells, the colours differ by less, and from all others' by more.
constexpr float kEnoughShared = 0.3f, kSameColours = 0.2f, kClearlyNearer = 0.05f;
// The same after the person was seen for so long: the colours are surer then.
constexpr float kSameColoursLater = 0.27f;
constexpr double kNew_s = 0.7;
// Boxes that overlap by more: the colours of one person may be on the other.
constexpr float kMixed = 0.4f;

// Later than `before_ns` by this time; times may be any numbers.
uint64_t between(int64_t before_ns, int64_t after_ns) { return uint64_t(after_ns) - uint64_t(before_ns); }
float centre_x(const Box& box) { return (box.x0 + box.x1) / 2; }
float centre_y(const Box& box) { return (box.y0 + box.y1) / 2; }
float size_of(const Box& box) { return std::max(box.width(), box.height()); }

Box moved(const Box& box, float x, float y) { return {box.x0 + x, box.y0 + y, box.x1 + x, box.y1 + y}; }

// Returns 0 for the same place up to 1 for the farthest one that is possible; nothing for places that are not.
std::optional<float> place_cost(const Box& expected, const Box& box) {
  const float iou = overlap(expected, box);
  const float size = (size_of(expected) + size_of(box)) / 2;
  const float distance = std::hypot(centre_x(expected) - centre_x(box), centre_y(expected) - centre_y(box));
  if (!(iou > kMinIou) && !(distance < kNear * size)) return std::nullopt;
  return 1 - iou;
}

}  // namespace

PersonTracker::PersonTracker(size_t max_people) : max_tracks_(max_people + kMaxAway) {
  tracks_.reserve(max_tracks_ + max_people);
}

void PersonTracker::begin_stream(int64_t last_id) {
  tracks_.clear();
  last_id_ = last_id;
  is_begun_ = false;
}

const std::vector<int64_t>& PersonTracker::update(const ImageView& image, const DensePlanes& planes,
                                                  const std::vector<Box>& boxes, std::optional<int64_t> time_ns) {
  move_time(image, time_ns);
  ++frame_;
  read_colours(image, planes, boxes.size(), colours_);
  track_of_.assign(boxes.size(), -1);
  is_taken_.assign(tracks_.size(), 0);
  recognise_by_place(boxes);
  recognise_by_colours(boxes);
  recognise_new(boxes);
  ids_.clear();
  for (size_t i = 0; i < boxes.size(); ++i) {
    if (track_of_[i] >= 0) {
      take_over(tracks_[size_t(track_of_[i])], i, boxes);
    } else {
      start(i, boxes[i]);
    }
    ids_.push_back(tracks_[size_t(track_of_[i])].id);
  }
  forget_oldest();
  return ids_;
}

double PersonTracker::seconds_since(const Track& track) const {
  return double(between(track.seen_ns, now_ns_)) / double(kSecond_ns);
}

void PersonTracker::move_time(const ImageView& image, std::optional<int64_t> time_ns) {
  const int64_t now_ns = time_ns.value_or(is_begun_ ? int64_t(uint64_t(now_ns_) + kFrame_ns) : 0);
  const bool goes_on = is_begun_ && now_ns >= now_ns_ && between(now_ns_, now_ns) <= kLongestPause_ns &&
                       image.width_px == width_px_ && image.height_px == height_px_;
  if (!goes_on) {
    for (Track& track : tracks_) track.has_place = false;
  }
  now_ns_ = now_ns;
  is_begun_ = true;
  width_px_ = image.width_px;
  height_px_ = image.height_px;
}

void PersonTracker::recognise_by_place(const std::vector<Box>& boxes) {
  costs_.assign(tracks_.size() * boxes.size(), kNoAssignment);
  for (size_t k = 0; k < tracks_.size(); ++k) {
    const Track& track = tracks_[k];
    if (!track.has_place) continue;
    const double since_s = seconds_since(track);
    if (since_s > kPlaceKnown_s) continue;
    const float ahead_s = float(std::min(since_s, kMotionKnown_s));
    const Box expected = moved(track.box, track.velocity_x * ahead_s, track.velocity_y * ahead_s);
    for (size_t i = 0; i < boxes.size(); ++i) {
      const std::optional<float> place = place_cost(expected, boxes[i]);
      if (!place) continue;
      const ColourDifference look = difference(track.colours, colours_[i]);
      if (look.shared > kEnoughShared && look.distance > kOtherPerson) continue;
      costs_[k * boxes.size() + i] = *place + kColourWeight * look.shared * look.distance;
    }
  }
  const std::vector<int>& person_of = assignment_.solve(costs_, int(tracks_.size()), int(boxes.size()));
  for (size_t k = 0; k < tracks_.size(); ++k) {
    if (person_of[k] < 0) continue;
    track_of_[size_t(person_of[k])] = int(k);
    is_taken_[k] = 1;
  }
}

bool PersonTracker::is_reachable(const Track& track, const Box& box) const {
  const double since_s = seconds_since(track);
  if (!track.has_place || since_s > kPlaceKnown_s) return true;
  const float distance = std::hypot(centre_x(track.box) - centre_x(box), centre_y(track.box) - centre_y(box));
  return distance < (kNear + kFastest * float(since_s)) * std::max(size_of(track.box), size_of(box));
}

template <class IsCandidate>
int PersonTracker::nearest_away(const SurfaceColours& colours, float max_distance, const IsCandidate& is_candidate,
                                float* distance) const {
  float nearest = 1, second = 1;
  int found = -1;
  for (size_t k = 0; k < tracks_.size(); ++k) {
    if (is_taken_[k] != 0 || !is_candidate(tracks_[k])) continue;
    const ColourDifference look = difference(tracks_[k].colours, colours);
    if (!(look.shared > kEnoughShared)) continue;
    if (look.distance < nearest) {
      second = nearest;
      nearest = look.distance;
      found = int(k);
    } else {
      second = std::min(second, look.distance);
    }
  }
  *distance = nearest;
  return nearest < max_distance && nearest + kClearlyNearer < second ? found : -1;
}

void PersonTracker::recognise_by_colours(const std::vector<Box>& boxes) {
  // The person and the track that are nearest to each other, again and again.
  while (true) {
    float best = 1;
    int person = -1, track = -1;
    for (size_t i = 0; i < boxes.size(); ++i) {
      if (track_of_[i] >= 0) continue;
      float distance = 1;
      const auto is_reached = [&](const Track& away) { return is_reachable(away, boxes[i]); };
      const int found = nearest_away(colours_[i], kSameColours, is_reached, &distance);
      if (found < 0 || distance >= best) continue;
      best = distance;
      person = int(i);
      track = found;
    }
    if (person < 0) return;
    track_of_[size_t(person)] = track;
    is_taken_[size_t(track)] = 1;
    tracks_[size_t(track)].is_new = false;
  }
}

void PersonTracker::recognise_new(const std::vector<Box>& boxes) {
  for (size_t i = 0; i < boxes.size(); ++i) {
    if (track_of_[i] < 0) continue;
    Track& track = tracks_[size_t(track_of_[i])];
    if (!track.is_new || double(between(track.begun_ns, now_ns_)) < kNew_s * double(kSecond_ns)) continue;
    track.is_new = false;
    const auto left_before = [&](const Track& away) { return away.seen_frame < track.begun_frame; };
    float distance = 1;
    const int found = nearest_away(track.colours, kSameColoursLater, left_before, &distance);
    if (found < 0) continue;
    is_taken_[size_t(found)] = 1;
    track.id = tracks_[size_t(found)].id;  // and the new id is nobody's any more
    track.colours.add(tracks_[size_t(found)].colours);
    tracks_[size_t(found)].id = 0;
  }
}

void PersonTracker::take_over(Track& track, size_t person, const std::vector<Box>& boxes) {
  const Box& box = boxes[person];
  const double since_s = seconds_since(track);
  if (!track.has_place || since_s > kPlaceKnown_s) {
    track.velocity_x = track.velocity_y = 0;
  } else if (since_s > 0) {
    const float x = centre_x(box) - centre_x(track.box), y = centre_y(box) - centre_y(track.box);
    track.velocity_x += kNewMotion * (x / float(since_s) - track.velocity_x);
    track.velocity_y += kNewMotion * (y / float(since_s) - track.velocity_y);
  }
  track.box = box;
  track.seen_ns = now_ns_;
  track.seen_frame = frame_;
  track.has_place = true;
  const auto is_mixed = [&](const Box& other) { return &other != &box && overlap(other, box) > kMixed; };
  if (std::none_of(boxes.begin(), boxes.end(), is_mixed)) track.colours.add(colours_[person]);
}

void PersonTracker::start(size_t person, const Box& box) {
  Track track;
  track.id = ++last_id_;
  track.box = box;
  track.seen_ns = track.begun_ns = now_ns_;
  track.seen_frame = track.begun_frame = frame_;
  track.colours = colours_[person];
  track_of_[person] = int(tracks_.size());
  tracks_.push_back(track);
}

void PersonTracker::forget_oldest() {
  const auto is_gone = [](const Track& track) { return track.id == 0; };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), is_gone), tracks_.end());
  while (tracks_.size() > max_tracks_) {
    // Tracks of an earlier time come first, whatever their clock said; then those seen longest ago.
    const auto is_older = [](const Track& a, const Track& b) {
      return a.has_place != b.has_place ? !a.has_place : a.seen_ns < b.seen_ns;
    };
    tracks_.erase(std::min_element(tracks_.begin(), tracks_.end(), is_older));
  }
}

}  // namespace maq
