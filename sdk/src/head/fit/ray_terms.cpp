#include "head/fit/ray_terms.h"

#include <algorithm>
#include <cmath>

#include "head/fit/pose_rays.h"
#include "head/fit/ray_losses.h"

namespace maq::head {
namespace {

constexpr double kClear = 40;       // s times a distance from which on nothing of a ray is taken away
constexpr double kEnough = 10;      // the same of one inside, from which on nothing is left
constexpr double kMinFacing = 0.1;  // cosine: surfaces seen flatter than this say nothing of themselves
constexpr double kMinPull = 1e-9;   // of a distance on the loss, below which its point is not gone back through
constexpr int kRefinements = 3;

Planes planes(std::array<std::vector<float>, 3>& columns) {
  return {columns[0].data(), columns[1].data(), columns[2].data()};
}

ConstPlanes const_planes(const std::array<std::vector<float>, 3>& columns) {
  return {columns[0].data(), columns[1].data(), columns[2].data()};
}

FieldPoints as_points(const std::array<std::vector<float>, 3>& columns, size_t count) {
  return {columns[0].data(), columns[1].data(), columns[2].data(), count};
}

void resize(std::array<std::vector<float>, 3>& columns, size_t count) {
  for (std::vector<float>& column : columns) column.resize(count);
}

void set(std::array<std::vector<float>, 3>& columns, size_t i, Vec3 p) {
  columns[0][i] = float(p.x), columns[1][i] = float(p.y), columns[2][i] = float(p.z);
}

Vec3 get(const std::array<std::vector<float>, 3>& columns, size_t i) {
  return {double(columns[0][i]), double(columns[1][i]), double(columns[2][i])};
}

}  // namespace

void RaySums::add(const RaySums& other) {
  colour += other.colour, matte += other.matte, point += other.point;
  rays += other.rays, hits += other.hits, coloured += other.coloured, left_out += other.left_out;
}

struct RayTerms::Call {
  const FieldEngine& engine;
  const DistanceGrid& grid;
  const std::vector<PoseRays>& poses;
  const FitRay* const* rays;
  bool has_gradient;
};

struct RayTerms::Track {
  const FitRay* ray = nullptr;
  const PoseRays* pose = nullptr;
  Vec3 base, direction;
  double begin = 0, end = 0;  // depths of the sections
  bool is_hit = false;
  double outside = 0, inside = 0;      // depths around the surface
  double f_outside = 0, f_inside = 0;  // distances there
  double depth = 0;                    // of the surface

  Vec3 at(double deep) const { return base + deep * direction; }
};

RayTerms::RayTerms(const FieldShape& shape, const CutPlane& cut, double sharpness, const RayTermOptions& options)
    : cut_(cut), sharpness_(sharpness), options_(options), parts_(shape, kParts), scratches_(kParts) {
  options_.sections = std::clamp(options_.sections, 1, 63);
}

RaySums RayTerms::run(const FieldEngine& engine, const DistanceGrid& grid, const std::vector<ScaledPose>& poses,
                      const FitRay* const* rays, size_t count, WorkerThreads& threads, RayGradient* gradient) {
  std::vector<PoseRays> pose_rays;
  for (const ScaledPose& pose : poses) pose_rays.emplace_back(pose);
  const Call call{engine, grid, pose_rays, rays, gradient != nullptr};
  for (Scratch& scratch : scratches_) {
    scratch.sums = {};
    scratch.by_poses.assign(poses.size(), {});
  }
  parts_.run(threads, count, kRays, [&](FieldParts::Part& part) {
    Scratch& scratch = scratches_[size_t(&part - &parts_.part(0))];
    for (size_t begin = part.begin; begin < part.end; begin += kRays) {
      run_part(call, begin, std::min(begin + kRays, part.end), part, scratch);
    }
  });
  RaySums sums;
  for (const Scratch& scratch : scratches_) sums.add(scratch.sums);
  if (gradient == nullptr) return sums;
  gradient->by_weights.set_zero();
  parts_.add_gradients(gradient->by_weights);
  gradient->by_poses.assign(poses.size(), {});
  for (const Scratch& scratch : scratches_) {
    for (size_t i = 0; i < poses.size(); ++i) {
      for (size_t k = 0; k < kPoseUnknowns; ++k) gradient->by_poses[i][k] += scratch.by_poses[i][k];
    }
  }
  return sums;
}

void RayTerms::run_part(const Call& call, size_t begin, size_t end, FieldParts::Part& part, Scratch& scratch) const {
  Track tracks[kRays];
  size_t count = 0;
  for (size_t i = begin; i < end; ++i) {
    const FitRay& ray = *call.rays[i];
    const PoseRays& pose = call.poses[ray.photo];
    Track& track = tracks[count];
    track = {};
    track.ray = &ray, track.pose = &pose;
    track.base = pose.base(double(ray.x_px), double(ray.y_px));
    track.direction = pose.direction(double(ray.x_px), double(ray.y_px));
    const double first = 0.95 * pose.eye_depth();
    const DistanceGrid::Nearest nearest = call.grid.find(track.base, track.direction, first, kEnough / sharpness_);
    ++scratch.sums.rays;
    if (!nearest.is_in_domain || sharpness_ * (nearest.distance_dm - call.grid.cell_dm()) > kClear) {
      scratch.sums.matte += options_.matte_weight * matte_loss(0, double(ray.matte), options_.matte_error_rate).loss;
      continue;
    }
    // The grid may be off by part of a cell.
    const double spare = 0.5 * call.grid.cell_dm() / length(track.direction);
    track.begin = std::max(first, nearest.begin - spare), track.end = nearest.end + spare;
    ++count;
  }
  if (count == 0) return;
  run_mattes(call, tracks, count, part, scratch);
  count = size_t(std::remove_if(tracks, tracks + count, [](const Track& track) { return !track.is_hit; }) - tracks);
  scratch.sums.hits += count;
  if (count == 0) return;
  refine_hits(call, tracks, count, part, scratch);
  run_surface(call, tracks, count, part, scratch);
}

// Opacities of all tracks, their losses and, where these pull at a distance, back to the field and the camera; and
// between which samples a track goes in.
void RayTerms::run_mattes(const Call& call, Track* tracks, size_t count, FieldParts::Part& part,
                          Scratch& scratch) const {
  const size_t sections = size_t(options_.sections), samples = sections + 1;
  resize(scratch.points, count * samples);
  scratch.distances.resize(count * samples);
  scratch.by_distances.resize(samples);
  const auto depth_at = [&](const Track& track, size_t k) {
    return track.begin + (track.end - track.begin) * double(k) / double(sections);
  };
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < samples; ++k) {
      set(scratch.points, i * samples + k, tracks[i].at(depth_at(tracks[i], k)));
    }
  }
  call.engine.distances(as_points(scratch.points, count * samples), part.workspace, scratch.distances.data());
  scratch.samples.clear();
  std::vector<float> pulls;
  for (size_t i = 0; i < count; ++i) {
    Track& track = tracks[i];
    float* distances = scratch.distances.data() + i * samples;
    uint64_t at_cut = 0;
    for (size_t k = 0; k < samples; ++k) {
      const double to_cut = cut_.distance(get(scratch.points, i * samples + k));
      if (!(to_cut > double(distances[k]))) continue;
      distances[k] = float(to_cut);
      at_cut |= uint64_t(1) << k;
    }
    for (size_t k = 0; k < sections && !track.is_hit; ++k) {
      if (!(distances[k] > 0) || !(distances[k + 1] <= 0)) continue;
      if ((at_cut >> k & 3) != 0) break;  // goes in through the clip plane, where nothing is known
      track.is_hit = true;
      track.outside = depth_at(track, k), track.inside = depth_at(track, k + 1);
      track.f_outside = double(distances[k]), track.f_inside = double(distances[k + 1]);
    }
    scratch.opacity.run(distances, sections, sharpness_);
    const OpacityLoss loss =
        matte_loss(scratch.opacity.log_transmittance(), double(track.ray->matte), options_.matte_error_rate);
    scratch.sums.matte += options_.matte_weight * loss.loss;
    const double pull = options_.matte_weight * loss.by_log_transmittance;
    if (!call.has_gradient || pull == 0) continue;
    scratch.opacity.back(pull, scratch.by_distances.data());
    for (size_t k = 0; k < samples; ++k) {
      const double by_distance = double(scratch.by_distances[k]);
      if (!(std::abs(by_distance) > kMinPull)) continue;
      if (at_cut >> k & 1) {
        track.pose->add_gradient(double(track.ray->x_px), double(track.ray->y_px), depth_at(track, k),
                                 by_distance * cut_.normal, scratch.by_poses[track.ray->photo].data());
        continue;
      }
      scratch.samples.push_back({i, depth_at(track, k)});
      pulls.push_back(float(by_distance));
    }
  }
  const size_t pulled = scratch.samples.size();
  if (pulled == 0) return;
  resize(scratch.points, pulled);
  resize(scratch.moved, pulled);
  for (size_t j = 0; j < pulled; ++j) {
    set(scratch.points, j, tracks[scratch.samples[j].ray].at(scratch.samples[j].depth));
  }
  scratch.distances.resize(std::max(scratch.distances.size(), pulled));
  call.engine.forward(as_points(scratch.points, pulled), part.workspace, {scratch.distances.data(), {}, {}, {}});
  scratch.sums.left_out += call.engine.backward(
      part.workspace, {pulls.data(), {}, {}}, WeightGradient::kPersonalGeometry, &part.gradient, planes(scratch.moved));
  for (size_t j = 0; j < pulled; ++j) {
    const Track& track = tracks[scratch.samples[j].ray];
    track.pose->add_gradient(double(track.ray->x_px), double(track.ray->y_px), scratch.samples[j].depth,
                             get(scratch.moved, j), scratch.by_poses[track.ray->photo].data());
  }
}

// Regula falsi (Illinois).
void RayTerms::refine_hits(const Call& call, Track* tracks, size_t count, FieldParts::Part& part,
                           Scratch& scratch) const {
  const auto between = [](const Track& track) {
    return track.outside + (track.inside - track.outside) * track.f_outside / (track.f_outside - track.f_inside);
  };
  resize(scratch.points, count);
  scratch.distances.resize(std::max(scratch.distances.size(), count));
  int sides[kRays] = {};
  for (size_t i = 0; i < count; ++i) tracks[i].depth = between(tracks[i]);
  for (int round = 0; round < kRefinements; ++round) {
    for (size_t i = 0; i < count; ++i) set(scratch.points, i, tracks[i].at(tracks[i].depth));
    call.engine.distances(as_points(scratch.points, count), part.workspace, scratch.distances.data());
    for (size_t i = 0; i < count; ++i) {
      Track& track = tracks[i];
      const double f = double(scratch.distances[i]);
      if (f > 0) {
        track.outside = track.depth, track.f_outside = f;
        if (sides[i] == 1) track.f_inside /= 2;
        sides[i] = 1;
      } else if (f < 0) {
        track.inside = track.depth, track.f_inside = f;
        if (sides[i] == -1) track.f_outside /= 2;
        sides[i] = -1;
      } else {
        continue;  // met, or not a number
      }
      track.depth = between(track);
    }
  }
}

void RayTerms::run_surface(const Call& call, const Track* tracks, size_t count, FieldParts::Part& part,
                           Scratch& scratch) const {
  resize(scratch.points, count);
  for (Columns* columns : {&scratch.normals, &scratch.logits, &scratch.templates, &scratch.by_logits,
                           &scratch.by_templates, &scratch.moved}) {
    resize(*columns, count);
    for (std::vector<float>& column : *columns) std::fill(column.begin(), column.end(), 0.0f);
  }
  for (size_t i = 0; i < count; ++i) set(scratch.points, i, tracks[i].at(tracks[i].depth));
  call.engine.forward(as_points(scratch.points, count), part.workspace,
                      {nullptr, planes(scratch.logits), planes(scratch.templates), planes(scratch.normals)});
  bool has_loss = false;
  for (size_t i = 0; i < count; ++i) {
    const FitRay& ray = *tracks[i].ray;
    const Vec3 normal = get(scratch.normals, i);
    const double facing = -dot(normal, tracks[i].direction) / (length(normal) * length(tracks[i].direction));
    if (!(facing > kMinFacing)) continue;  // or not a number
    has_loss = true;
    if (ray.has_point) {
      const float at[3] = {scratch.templates[0][i], scratch.templates[1][i], scratch.templates[2][i]};
      const double sigma = std::hypot(options_.point_sigma_dm, double(ray.point_sigma_dm));
      const ThreeLoss loss = template_loss(at, ray.point, sigma, options_.limit);
      scratch.sums.point += options_.point_weight * loss.loss;
      for (size_t c = 0; c < 3; ++c) scratch.by_templates[c][i] = float(options_.point_weight * loss.by[c]);
    }
    if (ray.has_colour) {
      const float at[3] = {scratch.logits[0][i], scratch.logits[1][i], scratch.logits[2][i]};
      const ThreeLoss loss = colour_loss(at, ray.rgb, options_.colour_sigma, options_.limit);
      scratch.sums.colour += options_.colour_weight * loss.loss;
      for (size_t c = 0; c < 3; ++c) scratch.by_logits[c][i] = float(options_.colour_weight * loss.by[c]);
      ++scratch.sums.coloured;
    }
  }
  if (has_loss && call.has_gradient) surface_back(call, tracks, part, scratch);
}

void RayTerms::surface_back(const Call& call, const Track* tracks, FieldParts::Part& part, Scratch& scratch) const {
  const size_t count = scratch.points[0].size();
  const size_t left_out =
      call.engine.backward(part.workspace, {nullptr, {}, const_planes(scratch.by_templates)},
                           WeightGradient::kPersonalGeometry, &part.gradient, planes(scratch.moved));
  scratch.sums.left_out += left_out;
  call.engine.backward(part.workspace, {nullptr, const_planes(scratch.by_logits), {}}, WeightGradient::kPersonalSurface,
                       &part.gradient);
  // The surface's point stays on the surface.
  scratch.by_distances.assign(count, 0.0f);
  for (size_t i = 0; i < count; ++i) {
    const Track& track = tracks[i];
    const Vec3 normal = get(scratch.normals, i), by_point = get(scratch.moved, i);
    const double along = dot(by_point, track.direction);
    if (length(by_point) == 0) continue;
    const double by_distance = -along / dot(normal, track.direction);
    scratch.by_distances[i] = float(by_distance);
    track.pose->add_gradient(double(track.ray->x_px), double(track.ray->y_px), track.depth,
                             by_point + by_distance * normal, scratch.by_poses[track.ray->photo].data());
  }
  call.engine.backward(part.workspace, {scratch.by_distances.data(), {}, {}}, WeightGradient::kPersonalGeometry,
                       &part.gradient);
}

}  // namespace maq::head
