// Depth of traced surfaces from neighbours, costs against correlation in double, and photos that show nothing.
#include <gtest/gtest.h>

#include "scene/stereo/semi_global.h"
#include "support/samples/textured_scene.h"

namespace {

using maq::DepthPlanes;
using maq::MatchingCost;
using textured_scene::camera_at;
using textured_scene::TracedView;
using textured_scene::turned;
using textured_scene::view_of;

std::vector<TracedView> views_from(const textured_scene::Surface& surface, double baseline, int width_px = 160) {
  std::vector<TracedView> views;
  for (const textured_scene::Vector& at : {textured_scene::Vector{0, 0, 0},
                                           {-baseline, 0, 0},
                                           {baseline, 0.1 * baseline, 0},
                                           {0, -baseline, 0},
                                           {0.1 * baseline, baseline, 0}}) {
    views.push_back(view_of(surface, camera_at(at, width_px, width_px * 3 / 4)));
  }
  return views;
}

std::vector<float> depth_of_first(const std::vector<TracedView>& views, double near, double far, int threads = 1) {
  std::vector<const maq::StereoPhoto*> neighbours;
  for (size_t i = 1; i < views.size(); ++i) neighbours.push_back(&views[i].photo);
  static MatchingCost costs;  // with what an earlier photo left
  static maq::SemiGlobal smooth;
  maq::WorkerThreads workers(threads);
  const DepthPlanes planes{near, far};
  costs.compute(views[0].photo, neighbours, planes, workers);
  std::vector<float> depth;
  smooth.solve(costs, planes, workers, depth);
  return depth;
}

size_t known(const std::vector<float>& depth) {
  return size_t(std::count_if(depth.begin(), depth.end(), [](float z) { return z > 0; }));
}

// 1 - correlation of windows of 7 x 7 around a pixel and where the plane takes it to.
double exact_cost(const TracedView& first, const TracedView& other, int x, int y, double depth) {
  double sums[5] = {0, 0, 0, 0, 0};
  const auto& a = first.photo.camera;
  const auto& b = other.photo.camera;
  for (int dy = -3; dy <= 3; ++dy) {
    for (int dx = -3; dx <= 3; ++dx) {
      const textured_scene::Vector at = {(x + dx - a.cx_px) / a.fx_px * depth, (y + dy - a.cy_px) / a.fy_px * depth,
                                         depth};
      textured_scene::Vector world = a.centre, seen = {0, 0, 0};
      for (size_t k = 0; k < 3; ++k) {
        for (size_t row = 0; row < 3; ++row) world[k] += a.rotation[3 * row + k] * at[row];
      }
      for (size_t row = 0; row < 3; ++row) {
        for (size_t k = 0; k < 3; ++k) seen[row] += b.rotation[3 * row + k] * (world[k] - b.centre[k]);
      }
      const double u = seen[0] / seen[2] * b.fx_px + b.cx_px, v = seen[1] / seen[2] * b.fy_px + b.cy_px;
      const int column = int(std::floor(u)), line = int(std::floor(v));
      const auto grey = [&](int i, int j) { return double(other.photo.grey[size_t(j * b.width_px + i)]); };
      const double p = u - column, q = v - line;
      const double value = (1 - q) * ((1 - p) * grey(column, line) + p * grey(column + 1, line)) +
                           q * ((1 - p) * grey(column, line + 1) + p * grey(column + 1, line + 1));
      const double mine = first.photo.grey[size_t((y + dy) * a.width_px + x + dx)];
      sums[0] += mine;
      sums[1] += value;
      sums[2] += mine * mine;
      sums[3] += value * value;
      sums[4] += mine * value;
    }
  }
  for (double& sum : sums) sum /= 49;
  const double spread_a = sums[2] - sums[0] * sums[0] + 4, spread_b = sums[3] - sums[1] * sums[1] + 4;
  return 1 - (sums[4] - sums[0] * sums[1]) / std::sqrt(spread_a * spread_b);
}

TEST(PlaneSweep, CostsAreTheCorrelationOfTheHalfOfTheNeighboursThatFitBest) {
  const std::vector<TracedView> views = views_from(textured_scene::plane({0.3, 0.1, 1}, 2), 0.15);
  const DepthPlanes planes{1.2, 3};
  for (size_t count = 1; count <= 4; ++count) {
    std::vector<const maq::StereoPhoto*> neighbours;
    for (size_t i = 1; i <= count; ++i) neighbours.push_back(&views[i].photo);
    MatchingCost costs;
    maq::WorkerThreads workers(2);
    costs.compute(views[0].photo, neighbours, planes, workers);
    for (int k = 0; k < 300; ++k) {
      const int x = 45 + k * 7 % 70, y = 40 + k * 11 % 40, plane = k * 13 % DepthPlanes::kCount;
      std::vector<double> each;
      for (size_t i = 1; i <= count; ++i) {
        each.push_back(std::min(1.0, exact_cost(views[0], views[i], x, y, 1 / planes.inverse_depth(plane))));
      }
      std::sort(each.begin(), each.end());
      const double expected = count > 2 ? (each[0] + each[1]) / 2 : each[0];
      EXPECT_NEAR(costs.pixel(x, y)[plane], 100 * expected, 3) << count << " neighbours, pixel " << x << ", " << y;
    }
  }
}

TEST(PlaneSweep, DepthOfASlantedPlaneIsRightBetweenPlanes) {
  const std::vector<TracedView> views = views_from(textured_scene::plane({0.3, 0.1, 1}, 2), 0.35, 320);
  const std::vector<float> depth = depth_of_first(views, 1.2, 3);
  EXPECT_GT(fraction_right(views[0], depth, 0.01), 0.99);
  EXPECT_GT(fraction_right(views[0], depth, 0.003), 0.95);  // planes are 0.8 % apart
}

TEST(PlaneSweep, DepthOfASphereBeforeAPlane) {
  const std::vector<TracedView> views = views_from(
      textured_scene::both(textured_scene::sphere({0, 0, 2}, 0.5), textured_scene::plane({0, 0, 1}, 3)), 0.35, 320);
  EXPECT_GT(fraction_right(views[0], depth_of_first(views, 1.2, 4), 0.01), 0.93);
}

TEST(PlaneSweep, OneNeighbourOfAnotherSizeAndExposureIsEnough) {
  const auto surface = textured_scene::plane({0.2, 0, 1}, 2);
  const std::vector<TracedView> views = {view_of(surface, camera_at({0, 0, 0})),
                                         view_of(surface, turned(camera_at({0.2, 0, 0}, 250, 133), 0.1), 0.6)};
  EXPECT_GT(fraction_right(views[0], depth_of_first(views, 1.2, 3), 0.01, 24), 0.9);
}

TEST(PlaneSweep, ARangeOfDepthOfOneToAThousandKeepsWhatIsNear) {
  const std::vector<TracedView> views = views_from(textured_scene::plane({0, 0, 1}, 2), 0.15);
  EXPECT_GT(fraction_right(views[0], depth_of_first(views, 1, 1000), 0.02), 0.95);
}

TEST(PlaneSweep, TheResultIsTheSameForAnyNumberOfThreads) {
  const std::vector<TracedView> views = views_from(textured_scene::sphere({0, 0, 2}, 0.7), 0.15, 132);
  const std::vector<float> depth = depth_of_first(views, 1, 3, 1);
  for (const int threads : {2, 3, 8}) EXPECT_EQ(depth_of_first(views, 1, 3, threads), depth) << threads;
}

TEST(PlaneSweep, BlackAndOverexposedPhotosHaveNoDepth) {
  for (const uint8_t level : {uint8_t(0), uint8_t(255)}) {
    std::vector<TracedView> views = views_from(textured_scene::plane({0, 0, 1}, 2), 0.2);
    for (TracedView& view : views) std::fill(view.photo.grey.begin(), view.photo.grey.end(), level);
    EXPECT_EQ(known(depth_of_first(views, 1, 3)), 0u) << int(level);
  }
}

TEST(PlaneSweep, NeighboursThatShowNothingOfThePhotoGiveNoDepth) {
  const auto surface = textured_scene::plane({0, 0, 1}, 2);
  const std::vector<TracedView> behind = {view_of(surface, camera_at({0, 0, 0})),
                                          view_of(surface, turned(camera_at({0.2, 0, 0}), 3.14159265))};
  EXPECT_EQ(known(depth_of_first(behind, 1, 3)), 0u);
  const std::vector<TracedView> far_aside = {view_of(surface, camera_at({0, 0, 0})),
                                             view_of(surface, camera_at({50, 0, 0}))};
  EXPECT_EQ(known(depth_of_first(far_aside, 1, 3)), 0u);
}

TEST(PlaneSweep, PhotosOfOnePixelToFewHaveAResult) {
  const auto surface = textured_scene::plane({0, 0, 1}, 2);
  for (const int side : {1, 2, 3, 7, 33}) {
    const std::vector<TracedView> views = {view_of(surface, camera_at({0, 0, 0}, side, 1)),
                                           view_of(surface, camera_at({0.1, 0, 0}, 1, side))};
    EXPECT_EQ(depth_of_first(views, 1, 3).size(), size_t(side));
  }
}

TEST(PlaneSweep, APlaneSeenEdgeOnTakesNothingFromThePlaneBehindIt) {
  // A floor at eye level is a line in the photo.
  const auto wall = textured_scene::plane({0, 0, 1}, 2.5), floor = textured_scene::plane({0, 1, 0}, 1e-4);
  const std::vector<TracedView> views = views_from(textured_scene::both(wall, floor), 0.1);
  EXPECT_GT(fraction_right(views[0], depth_of_first(views, 1, 4), 0.02), 0.4);
}

}  // namespace
