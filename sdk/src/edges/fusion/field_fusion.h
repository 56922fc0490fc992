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
  double cell_m = 0;               // size of a grid cell; 0: the median footprint of the views
  double reach_r = 6;              // a view saw a point if the pixels around it are this near
  int64_t max_pixels = 1 << 25;    // limit for all views, six bytes each
  int64_t max_points = 4'000'000;  // limit for the result, about 110 bytes each during fusion
};

struct FusedPoint {
  Vec3 point;         // from FusedField::origin
  Vec3 normal;        // length 1, towards the cameras that saw the point
  float distance_m;   // to the nearest sharp curve that a view sees, at most eps_r * r_m
  float r_m;          // the smallest footprint in which a view saw the point
  int32_t views = 0;  // number of views that saw the point
};

struct FusedField {
  std::array<double, 3> origin{};  // in the world, amid the cameras
  double cell_m = 0;
  float eps_r = 0;
  std::vector<FusedPoint> points;  // sorted by position; the order of views has no effect
  int64_t outside_pixels = 0;      // dropped: more than a million cells from the origin
  int64_t mixed_points = 0;        // dropped: surfaces thinner than one cell
};

class FieldFusion {
 public:
  explicit FieldFusion(const FusionOptions& options = {}) : options_(options) {}

  // Keeps the field of a view; `pose` is its camera. A view without known depth is counted, but not kept. Throws
  // MAQ_ERROR_INVALID_ARGUMENT for planes of another size and for an eps_r that differs from earlier views, the errors
  // of check_camera(), and MAQ_ERROR_UNSUPPORTED if all views have more pixels than max_pixels.
  void add_view(const EdgeField& field, const PinholeCamera& pose);

  int views() const { return views_; }
  int views_without_depth() const { return views_ - int(kept_.size()); }
  const std::vector<FusionView>& kept() const { return kept_; }

  using Progress = std::function<void(float share)>;
  // Computes the points of all views, one for each grid cell. The distance of a point is the mean of the smaller half
  // of the distances from the views that see it. More views can be added afterwards. Calls `progress` on this thread.
  // Throws MAQ_CANCELLED once `is_cancelled` is true, MAQ_ERROR_UNSUPPORTED for more than max_points.
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
