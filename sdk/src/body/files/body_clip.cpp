#include "body/files/body_clip.h"

#include <algorithm>

#include "core/error.h"

namespace maq::body {
namespace {

constexpr double kFocalOfSide = 1.2;

}  // namespace

std::array<double, kMaxShapes> ClipPerson::shape() const {
  std::array<double, kMaxShapes> mean{};
  for (const ClipPose& pose : poses) {
    for (size_t s = 0; s < kMaxShapes; ++s) mean[s] += pose.pose.shape[s] / double(poses.size());
  }
  return mean;
}

double ClipPerson::length_s() const {
  return poses.empty() ? 0 : 1e-9 * double(poses.back().timestamp_ns - poses.front().timestamp_ns);
}

Vec3 place_in_metres(const BodyCamera& camera, Vec3 place, int width_px, int height_px) {
  if (camera.is_perspective) return place;
  const double focal_px = kFocalOfSide * std::max(width_px, height_px);
  const BodyCamera assumed = {true, focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1)};
  return place_of(assumed, {place.x, place.y}, scale_at(camera, place));
}

void BodyClip::add(int64_t id, const ClipPose& pose) {
  const auto is_same = [&](const ClipPerson& person) { return id != 0 && person.id == id; };
  const auto found = std::find_if(people_.begin(), people_.end(), is_same);
  if (found != people_.end()) {
    if (pose.timestamp_ns > found->poses.back().timestamp_ns) found->poses.push_back(pose);
    return;
  }
  if (people_.size() == kMaxPeople) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "A clip of bodies has at most ", kMaxPeople,
                " people; save it and begin another.");
  }
  people_.push_back({id, {pose}});
}

std::vector<const ClipPerson*> BodyClip::people() const {
  std::vector<const ClipPerson*> sorted;
  for (const ClipPerson& person : people_) sorted.push_back(&person);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const ClipPerson* a, const ClipPerson* b) { return a->poses.size() > b->poses.size(); });
  return sorted;
}

}  // namespace maq::body
