#include "edges/fusion/field_fusion.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/rounding.h"
#include "edges/fusion/point_grid.h"

namespace maq {
namespace {

constexpr double kFacing = 0.1;  // minimum cosine between a surface and the direction to a camera that sees it
constexpr double kMixed = 0.3;   // minimum length of the mean normal of a cell
constexpr int64_t kPointsOfTask = 2048;
constexpr float kFractionOfGrid = 0.3f;  // share of the time

template <class Value>
Value median_of(std::vector<Value> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void check_field_to_fuse(const EdgeField& field) {
  const size_t pixels = size_t(std::max(field.width, 0)) * size_t(std::max(field.height, 0));
  if (pixels == 0 || field.distance_r.size() != pixels || field.depth_m.size() != pixels || !(field.eps_r > 0)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The field of the view has planes of ", field.distance_r.size(), " and ",
                field.depth_m.size(), " values for ", field.width, " x ", field.height, " pixels, cut off at ",
                field.eps_r, " r.");
  }
}

// The smaller half, because a view in which an edge is hidden gives too large a distance. Too small ones are errors.
double mean_of_smaller_half(std::vector<double>& values) {
  const size_t count = (values.size() + 1) / 2;
  std::sort(values.begin(), values.end());
  return std::accumulate(values.begin(), values.begin() + std::ptrdiff_t(count), 0.0) / double(count);
}

void check_not_cancelled(const std::atomic<bool>& is_cancelled) {
  if (is_cancelled) throw Error(MAQ_CANCELLED, "The fusion was cancelled.");
}

}  // namespace

void FieldFusion::add_view(const EdgeField& field, const PinholeCamera& pose) {
  check_field_to_fuse(field);
  check_camera(pose, "The view's camera");
  if (pose.width_px != field.width || pose.height_px != field.height) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The view's camera is of ", pose.width_px, " x ", pose.height_px,
                " pixels, but its field has ", field.width, " x ", field.height,
                "; give the camera of the depth image.");
  }
  if (eps_r_ != 0 && field.eps_r != eps_r_) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The view's field is cut off at ", field.eps_r, " r, but those before at ",
                eps_r_, "; fuse fields of one bundle.");
  }
  const auto pixels = int64_t(field.distance_r.size());
  if (pixels_ + pixels > options_.max_pixels) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "With this view of ", field.width, " x ", field.height, " pixels there are ",
                pixels_ + pixels, " of all views, over the limit of ", options_.max_pixels,
                "; add fewer or smaller views.");
  }
  FusionView view(field, pose);
  if (view.known_pixels() > 0) {
    kept_.push_back(std::move(view));
    pixels_ += pixels;
  }
  eps_r_ = field.eps_r;
  ++views_;
}

std::array<double, 3> FieldFusion::middle_of_cameras() const {
  std::array<double, 3> middle{};
  for (size_t i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (const FusionView& view : kept_) values.push_back(view.camera().centre[i]);
    middle[i] = median_of(std::move(values));
  }
  return middle;
}

double FieldFusion::median_footprint_m() const {
  std::vector<double> values;
  for (const FusionView& view : kept_) values.push_back(view.median_depth_m() / view.focal_px());
  return median_of(std::move(values));
}

void FieldFusion::fuse(WorkerThreads& threads, const std::atomic<bool>& is_cancelled, const Progress& progress,
                       FusedField& result) const {
  result = {};
  result.eps_r = eps_r_;
  result.cell_m = options_.cell_m;
  if (kept_.empty()) return;
  result.origin = middle_of_cameras();
  if (options_.cell_m == 0) result.cell_m = median_footprint_m();
  const auto report = [&](float share) {
    check_not_cancelled(is_cancelled);
    if (progress) progress(share);
  };

  PointGrid grid(result.cell_m, size_t(options_.max_points));
  // Far from the world's origin coordinates have no digits left for the scene; differences of cameras do.
  const auto from_origin = [&](const FusionView& view) {
    const auto& centre = view.camera().centre;
    return Vec3{centre[0] - result.origin[0], centre[1] - result.origin[1], centre[2] - result.origin[2]};
  };
  for (size_t i = 0; i < kept_.size(); ++i) {
    report(kFractionOfGrid * float(i) / float(kept_.size()));
    const FusionView& view = kept_[i];
    const Vec3 centre = from_origin(view);
    for (int y = 0; y < view.camera().height_px; ++y) {
      for (int x = 0; x < view.camera().width_px; ++x) {
        const double z = view.depth(x, y);
        if (!(z > 0)) continue;
        const auto added =
            grid.add(view.to_world(view.point(x, y)) + centre, view.to_world(view.normal(x, y)), z / view.focal_px());
        if (added == PointGrid::Added::kOutside) ++result.outside_pixels;
        if (added == PointGrid::Added::kFull) {
          throw Error(MAQ_ERROR_UNSUPPORTED, "The views have more than ", options_.max_points, " points ",
                      result.cell_m, " m apart, the limit; raise cell_m, or max_points and its memory.");
        }
      }
    }
  }

  const std::vector<PointGrid::Cell>& cells = grid.sorted();
  for (const PointGrid::Cell& cell : cells) {
    const Vec3 normal = grid.normal(cell);
    if (length(normal) < kMixed) {
      ++result.mixed_points;
      continue;
    }
    result.points.push_back({grid.point(cell), normalized(normal), 0, cell.r_m, 0});
  }
  std::vector<Vec3> centres;
  for (const FusionView& view : kept_) centres.push_back(from_origin(view));
  const auto count = int64_t(result.points.size());
  const size_t tasks = size_t(divide_up(count, kPointsOfTask));
  const auto find_distances = [&](size_t task) {
    std::vector<double> values;
    const int64_t first = int64_t(task) * kPointsOfTask, last = std::min(count, first + kPointsOfTask);
    for (int64_t i = first; i < last; ++i) {
      FusedPoint& point = result.points[size_t(i)];
      values.clear();
      for (size_t k = 0; k < kept_.size(); ++k) {
        const FusionView& view = kept_[k];
        const Vec3 seen = point.point - centres[k];
        if (!(-dot(point.normal, seen) > kFacing * length(seen))) continue;
        const double distance_m = view.distance_m(view.to_camera(seen), double(point.r_m), options_.reach_r);
        if (distance_m >= 0) values.push_back(distance_m);
      }
      point.views = int32_t(values.size());
      point.distance_m = values.empty() ? eps_r_ * point.r_m : float(mean_of_smaller_half(values));
    }
  };
  // Between rounds of tasks there is time to report and to stop.
  constexpr size_t kTasksOfRound = 32;
  for (size_t begin = 0; begin < tasks; begin += kTasksOfRound) {
    report(kFractionOfGrid + (1 - kFractionOfGrid) * float(begin) / float(tasks));
    threads.run(std::min(kTasksOfRound, tasks - begin), [&](size_t task, int) { find_distances(begin + task); });
  }
  report(1);
}

}  // namespace maq
