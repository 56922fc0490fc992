// Distance fields of several posed views as one field on points (DEF, arXiv 2011.15081, fusion over views).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/math/vec3.h"
#include "core/worker_threads.h"
#include "edges/edge_field.h"
#include "edges/fusion/fusion_view.h"
#include "image/geometry/pinhole_camera.h"

namespace maq {

struct FusionOptions {
  double cell_m = 0;               // of the grid of points; 0: the median footprint of the views
  double reach_r = 6;              // a view saw a point when pixels about it are so near
  int64_t max_pixels = 1 << 25;    // of all views, six bytes each
  int64_t max_points = 4'000'000;  // of the result, some 110 bytes each while it is made
};

struct FusedPoint {
  Vec3 point;         // from FusedField::origin
  Vec3 normal;        // of length 1, towards the cameras that saw it
  float distance_m;   // to the nearest sharp curve that a view sees, at most eps_r * r_m
  float r_m;          // the smallest footprint in which a view saw it
  int32_t views = 0;  // how many saw it
};

struct FusedField {
  std::array<double, 3> origin{};  // in the world, amid the cameras
  double cell_m = 0;
  float eps_r = 0;
  std::vector<FusedPoint> points;  // in the order of their places; the order of views has no effect
  int64_t outside_pixels = 0;      // a million cells and more from the origin
  int64_t mixed_points = 0;        // left out: both sides of something thin are in one cell
};

class FieldFusion {
 public:
  // Throws MAQ_ERROR_INVALID_ARGUMENT where an option is not in its range.
  explicit FieldFusion(const FusionOptions& options = {});

  // Keeps a view's field; `pose` is the camera that took it. One without known depth counts, but is not kept. Throws
  // MAQ_ERROR_INVALID_ARGUMENT for a field whose planes have not its size, an eps_r other than that of the views
  // before, and what check_camera() throws; MAQ_ERROR_UNSUPPORTED where the views have more pixels than max_pixels.
  void add_view(const EdgeField& field, const PinholeCamera& pose);

  int views() const { return views_; }
  int views_without_depth() const { return views_ - int(kept_.size()); }
  const std::vector<FusionView>& kept() const { return kept_; }

  using Progress = std::function<void(float share)>;
  // Points of all views, one a cell of the grid, each with what the views that see it say: the mean of the smaller half
  // of their distances. Views and options stay, so that more can be added. `progress` is called by this thread. Throws
  // MAQ_CANCELLED where `is_cancelled` gets true, MAQ_ERROR_UNSUPPORTED for more than max_points.
  void fuse(WorkerThreads& threads, const std::atomic<bool>& is_cancelled, const Progress& progress,
            FusedField& result) const;

 private:
  std::array<double, 3> middle_of_cameras() const;
  double median_footprint_m() const;

  FusionOptions options_;
  int views_ = 0;
  int64_t pixels_ = 0;
  float eps_r_ = 0;
  std::vector<FusionView> kept_;
};

}  // namespace maq
