#include "body/fit/people_fitter.h"

#include <algorithm>

namespace maq::body {
namespace {

constexpr int64_t kForgetAfter_ns = 1'000'000'000;
constexpr int kSampledPixels = 220;
constexpr int64_t kMinPixels = 100;
constexpr double kMinConfidence = 0.15;
constexpr double kMaxFrames = 30;        // of the running mean of a shape
constexpr double kNoiseFrames = 8;       // of the running mean of the labels' noise
constexpr double kPrecisionOfFrame = 1;  // that each frame adds to the prior of the shape

}  // namespace

PeopleFitter::PeopleFitter(const BodyModel& model, const FitSettings& settings)
    : model_(model), fitter_(model, settings) {
  seen_.points.reserve(4 * kSampledPixels);
  tracks_.reserve(kMaxTracks);
}

void PeopleFitter::begin_frame(const LabelImage& image, const BodyCamera& camera, int64_t timestamp_ns) {
  image_ = image;
  camera_ = camera;
  if (timestamp_ns < now_ns_) tracks_.clear();
  now_ns_ = timestamp_ns;
  const auto is_old = [&](const Track& track) {
    return uint64_t(now_ns_) - uint64_t(track.seen_ns) > uint64_t(kForgetAfter_ns);
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), is_old), tracks_.end());
  people_ = find_people(image);
}

PeopleFitter::Track* PeopleFitter::find_track(int64_t id) {
  const auto found = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& track) { return track.id == id; });
  return found == tracks_.end() ? nullptr : &*found;
}

void PeopleFitter::keep(int64_t id, const FittedBody& body) {
  const BodyPose& pose = body.pose;
  Track* track = find_track(id);
  if (track == nullptr) {
    if (tracks_.size() == kMaxTracks) {
      const auto is_older = [](const Track& a, const Track& b) { return a.seen_ns < b.seen_ns; };
      tracks_.erase(std::min_element(tracks_.begin(), tracks_.end(), is_older));
    }
    tracks_.push_back({});
    track = &tracks_.back();
    track->id = id;
  }
  track->pose = pose;
  track->is_perspective = camera_.is_perspective;
  track->seen_ns = now_ns_;
  track->frames = std::min(track->frames + 1, kMaxFrames);
  track->noise += (body.noise - track->noise) / std::min(track->frames, kNoiseFrames);
  for (size_t s = 0; s < kMaxShapes; ++s) track->shape[s] += (pose.shape[s] - track->shape[s]) / track->frames;
}

FittedBody PeopleFitter::fit(const PersonRequest& person) {
  const PersonPixels& pixels = people_[person.number];
  FittedBody body;
  body.pose = mean_pose(model_);
  if (pixels.count < kMinPixels) return body;
  sample_person(model_, image_, person.number, pixels, kSampledPixels, seen_);
  if (person.keypoints != nullptr) add_keypoints(model_, person.keypoints, kMinConfidence, seen_);
  const Track* const track = person.id == 0 ? nullptr : find_track(person.id);
  const bool is_warm = track != nullptr && track->is_perspective == camera_.is_perspective;
  ShapePrior shape;
  BodyPose before;
  if (is_warm) {
    shape.mean = track->shape;
    shape.precision += kPrecisionOfFrame * track->frames;
    before = track->pose;
  }
  shape.height_m = person.height_m;
  body = fitter_.fit(seen_, camera_, is_warm ? &before : nullptr, shape, is_warm ? track->noise : 0);
  if (body.status == FitStatus::kFitted && person.id != 0) keep(person.id, body);
  return body;
}

}  // namespace maq::body
