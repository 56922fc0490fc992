// The losses of rays, their gradients against finite differences, and the parts they are made of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "head/fit/adam.h"
#include "head/fit/pose_rays.h"
#include "head/fit/ray_losses.h"
#include "head/fit/ray_terms.h"
#include "head/synthetic_head.h"
#include "support/expect_error.h"

namespace ray_terms {
namespace {

using namespace maq::head;       // NOLINT
using namespace synthetic_head;  // NOLINT

const FieldCodes kCodes = {{0.4f, -0.5f, 0.3f, 0.2f}, {0.5f, -0.2f}};

struct Scene {
  FitRays rays;
  std::vector<const FitRay*> chosen;
  std::vector<ScaledPose> poses;
};

// Rays of two photos of one head, seen with codes and cameras that are a little wrong.
Scene scene() {
  Scene made;
  const FieldCodes truth = {{0.8f, -0.9f, 0.1f, -0.3f}, {1.0f, -0.7f}};
  const double wrong[7] = {0.02, -0.03, 0.01, 2, -1, 0.02, 0.03};
  for (unsigned i = 0; i < 2; ++i) {
    const HeadCamera camera = camera_at(6 - i, 900, 0.3 - 0.7 * i, 0.1);
    Noise noise;
    noise.seed = i;
    FitRayOptions options;
    options.side_px = 64;
    add_fit_rays(photo_of(truth, camera, noise), i, options, made.rays);
    made.poses.push_back(moved(scaled_pose_of(camera, {}), wrong));
  }
  for (size_t i = 0; i < made.rays.fitted.size(); i += 5) made.chosen.push_back(&made.rays.fitted[i]);
  return made;
}

class Model {
 public:
  explicit Model(const RayTermOptions& options)
      : engine_(field_shape()),
        grid_(prior().bounds, prior().cut, 32),
        terms_(field_shape(), prior().cut, 40, options) {
    set(kCodes);
    grid_.update(engine_, threads_);
  }
  void set(const FieldCodes& codes) { engine_.set_weights(prior().bases.combine(codes)); }
  RaySums run(const Scene& scene, const std::vector<ScaledPose>& poses, RayGradient* gradient = nullptr) {
    return terms_.run(engine_, grid_, poses, scene.chosen.data(), scene.chosen.size(), threads_, gradient);
  }

 private:
  maq::WorkerThreads threads_{1};
  FieldEngine engine_;
  DistanceGrid grid_;
  RayTerms terms_;
};

RayTermOptions only(const std::string& term) {
  RayTermOptions options;
  options.colour_weight = term == "colour";
  options.matte_weight = term == "matte", options.point_weight = term == "point";
  options.sections = 60;
  return options;
}

TEST(RayTerms, GradientsOfEachLossAreThoseOfFiniteDifferences) {
  const Scene seen = scene();
  for (const std::string term : {"colour", "matte", "point"}) {
    Model model(only(term));
    RayGradient gradient{FieldWeights(field_shape()), {}};
    const RaySums sums = model.run(seen, seen.poses, &gradient);
    EXPECT_GT(sums.total(), 1);
    EXPECT_GT(sums.hits, 200u);
    EXPECT_EQ(sums.left_out, 0u);
    EXPECT_NEAR(model.run(seen, seen.poses).total(), sums.total(), 1e-9 * sums.total());
    FieldCodes by;
    prior().bases.code_gradient(gradient.by_weights, by);
    // Shape codes, colour codes, the pose of the second photo.
    std::vector<double> got(by.shape.begin(), by.shape.end()), expected;
    got.insert(got.end(), by.colour.begin(), by.colour.end());
    got.insert(got.end(), gradient.by_poses[1].begin(), gradient.by_poses[1].end());
    for (size_t k = 0; k < got.size(); ++k) {
      double totals[2];
      const double size = k < 6 ? 2e-3 : k == 9 || k == 10 ? 0.02 : 2e-4;
      for (int side = 0; side < 2; ++side) {
        FieldCodes codes = kCodes;
        std::vector<ScaledPose> poses = seen.poses;
        double step[7] = {};
        const double amount = (side == 0 ? -1 : 1) * size;
        if (k < 4) codes.shape[k] += float(amount);
        if (k >= 4 && k < 6) codes.colour[k - 4] += float(amount);
        if (k >= 6) step[k - 6] = amount, poses[1] = moved(poses[1], step);
        model.set(codes);
        totals[side] = model.run(seen, poses).total();
      }
      model.set(kCodes);
      expected.push_back((totals[1] - totals[0]) / (2 * size));
    }
    // A colour moves no surface, and so no camera.
    const bool is_held = term == "colour";
    const auto near = [&](size_t begin, size_t end, double tolerance) {
      double size = 1e-3;
      for (size_t k = begin; k < end; ++k) size = std::max(size, std::abs(expected[k]));
      for (size_t k = begin; k < end; ++k) EXPECT_NEAR(got[k], expected[k], tolerance * size) << term << ' ' << k;
    };
    if (is_held) {
      for (const size_t k : {0u, 1u, 2u, 3u, 6u, 7u, 8u, 9u, 10u, 11u, 12u}) EXPECT_EQ(got[k], 0) << k;
    }
    near(is_held ? 4 : 0, 6, term == "matte" ? 5e-3 : 2e-3);
    if (is_held) continue;
    // The sections of the mattes' rays move with the camera.
    near(6, 9, term == "matte" ? 0.05 : 2e-3);
    near(9, 11, term == "matte" ? 0.05 : 2e-3);
    near(11, 13, term == "matte" ? 0.05 : 2e-3);
  }
}

TEST(RayTerms, ThreadsChangeNoBit) {
  const Scene seen = scene();
  FieldEngine engine(field_shape());
  engine.set_weights(prior().bases.combine(kCodes));
  std::vector<RaySums> sums;
  std::vector<RayGradient> gradients;
  for (const int count : {1, 2, 4}) {
    maq::WorkerThreads threads(count);
    DistanceGrid grid(prior().bounds, prior().cut, 32);
    grid.update(engine, threads);
    RayTerms terms(field_shape(), prior().cut, 40, {});
    gradients.push_back({FieldWeights(field_shape()), {}});
    sums.push_back(
        terms.run(engine, grid, seen.poses, seen.chosen.data(), seen.chosen.size(), threads, &gradients.back()));
  }
  for (size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(sums[i].total(), sums[0].total());
    EXPECT_EQ(gradients[i].by_weights.values(), gradients[0].by_weights.values());
    EXPECT_EQ(gradients[i].by_poses, gradients[0].by_poses);
  }
}

TEST(RayTerms, RaysThatMissAndNumbersThatAreNoneHaveNoGradient) {
  Scene seen = scene();
  std::vector<FitRay> rays(6);
  rays[0].x_px = 5000, rays[0].matte = 0;  // beyond the domain
  rays[1].x_px = 250, rays[1].matte = 0;   // far from the head
  rays[2].x_px = NAN, rays[2].matte = 1;
  rays[3].matte = NAN;  // through its middle
  rays[4].matte = 1;
  rays[5].matte = 0;
  seen.chosen.clear();
  for (const FitRay& ray : rays) seen.chosen.push_back(&ray);
  RayTermOptions options;
  options.matte_error_rate = 0.05;
  Model model(options);
  RayGradient gradient{FieldWeights(field_shape()), {}};
  const RaySums sums = model.run(seen, seen.poses, &gradient);
  EXPECT_EQ(sums.rays, 6u);
  EXPECT_EQ(sums.hits, 3u);
  EXPECT_NEAR(sums.matte, -3 * std::log(0.95) - 2 * std::log(0.05), 1e-3);
  for (const float value : gradient.by_weights.values()) ASSERT_LT(std::abs(value), 1e-3f);
  // A field of NaN is hit by nothing.
  FieldWeights none = prior().bases.combine(kCodes);
  std::fill(none.values().begin(), none.values().end(), NAN);
  FieldEngine engine(field_shape());
  engine.set_weights(none);
  maq::WorkerThreads threads(1);
  DistanceGrid grid(prior().bounds, prior().cut, 32);
  grid.update(engine, threads);
  RayTerms terms(field_shape(), prior().cut, 40, options);
  const RaySums nothing =
      terms.run(engine, grid, seen.poses, seen.chosen.data(), seen.chosen.size(), threads, &gradient);
  EXPECT_EQ(nothing.hits, 0u);
  EXPECT_TRUE(std::isfinite(nothing.total()));
  for (const float value : gradient.by_weights.values()) ASSERT_EQ(value, 0);
}

// --- what they are made of -------------------------------------------------------------------------------------------

template <class Loss>
void expect_slope(double got, double size, const Loss& loss) {
  const double expected = (loss(size) - loss(-size)) / (2 * size);
  EXPECT_NEAR(got, expected, 1e-5 * (1 + std::abs(expected)));
}

TEST(RayTerms, LossesHaveTheSlopesThatTheySay) {
  for (const float far : {0.1f, 1.0f, 6.0f}) {
    const float logits[3] = {0.3f * far, -0.5f, far}, rgb[3] = {0.2f, 0.6f, 0.4f};
    const float points[3] = {0.1f * far, 0.2f, -0.3f}, seen[3] = {0.1f, 0.15f, -0.25f};
    for (int c = 0; c < 3; ++c) {
      expect_slope(colour_loss(logits, rgb, 0.12, 9).by[c], 0.0625, [&](double by) {
        float at[3] = {logits[0], logits[1], logits[2]};
        at[c] += float(by) / 64;
        return 64 * colour_loss(at, rgb, 0.12, 9).loss;
      });
      expect_slope(template_loss(points, seen, 0.1, 9).by[c], 0.0625, [&](double by) {
        float at[3] = {points[0], points[1], points[2]};
        at[c] += float(by) / 1024;
        return 1024 * template_loss(at, seen, 0.1, 9).loss;
      });
    }
  }
}

TEST(RayTerms, AWrongMatteCostsAndPullsOnlySoMuch) {
  for (const double matte : {0.0, 0.3, 1.0}) {
    for (const double clear : {-1e-3, -0.01, -0.7, -5.0, -300.0}) {
      expect_slope(matte_loss(clear, matte, 0.05).by_log_transmittance, 1e-3 * std::min(1.0, -clear),
                   [&](double by) { return matte_loss(clear + by, matte, 0.05).loss; });
      EXPECT_LE(matte_loss(clear, matte, 0.05).loss, -std::log(0.05) + 1e-12);
      EXPECT_LE(std::abs(matte_loss(clear, matte, 0.05).by_log_transmittance), 20);
    }
    EXPECT_TRUE(std::isfinite(matte_loss(-INFINITY, matte, 0.05).loss));
  }
  EXPECT_EQ(matte_loss(-1, NAN, 0.05).loss, 0);
  EXPECT_LT(matte_loss(-3, 1, 0.05).loss, matte_loss(-0.1, 1, 0.05).loss);
  EXPECT_GT(matte_loss(-1, 1, 0.05).by_log_transmittance, 0);
}

TEST(RayTerms, RaysGoThroughThePixelsThatTheirPointsAreSeenAt) {
  const HeadCamera camera = camera_at(6, 900, 0.4, -0.2);
  const ScaledPose pose = scaled_pose_of(camera, {});
  const PoseRays rays(pose);
  EXPECT_NEAR(rays.eye_depth(), -6, 1e-9);
  const Vec3 weights = {0.3, -0.7, 0.5};
  for (const double depth : {-2.0, 0.0, 1.5}) {
    const Vec3 p = rays.base(40, -30) + depth * rays.direction(40, -30), q = camera.head_to_camera * p;
    EXPECT_NEAR(900 * q.x / q.z, 40, 1e-9);
    EXPECT_NEAR(900 * q.y / q.z, -30, 1e-9);
    EXPECT_NEAR(q.z, 6 + depth, 1e-9);
    double by_pose[7] = {};
    rays.add_gradient(40, -30, depth, weights, by_pose);
    for (int k = 0; k < 7; ++k) {
      expect_slope(by_pose[k], k == 3 || k == 4 ? 0.1 : 1e-4, [&](double by) {
        double step[7] = {};
        step[k] = by;
        const PoseRays to(moved(pose, step));
        return maq::dot(weights, to.base(40, -30) + depth * to.direction(40, -30));
      });
    }
  }
}

TEST(RayTerms, TheGridFindsWhereRaysGoIn) {
  Model model({});
  FieldEngine engine(field_shape());
  const FieldWeights weights = prior().bases.combine(kCodes);
  engine.set_weights(weights);
  maq::WorkerThreads threads(2);
  DistanceGrid grid(prior().bounds, prior().cut, 32);
  grid.update(engine, threads);
  std::vector<Vec3> from, to;
  for (int i = 0; i < 400; ++i) {
    const int row = i / 20, column = i % 20;
    from.push_back({-1.5 + 3.0 * column / 19, -2.1, -1.4 + 2.8 * row / 19});
    to.push_back(from.back() + Vec3{0.2, 4.1, -0.1});
  }
  const std::vector<float> hits = first_hits(weights, from, to);
  int hit = 0, wrong = 0;
  for (size_t i = 0; i < hits.size(); ++i) {
    const DistanceGrid::Nearest found = grid.find(from[i], to[i] - from[i], 0, 0.25);
    EXPECT_TRUE(found.is_in_domain);
    if (found.is_hit != (hits[i] >= 0)) {
      ++wrong;
      continue;
    }
    EXPECT_LE(found.begin, found.depth);
    EXPECT_LE(found.depth, found.end);
    hit += found.is_hit;
    if (found.is_hit) {
      EXPECT_NEAR(found.depth * 4.1, double(hits[i]) * 4.1, 0.15);
    } else {
      EXPECT_NEAR(grid.at(from[i] + found.depth * (to[i] - from[i])), found.distance_dm, 1e-9);
    }
  }
  EXPECT_GT(hit, 100);
  EXPECT_LE(wrong, 8);
  EXPECT_FALSE(grid.find({9, 9, 9}, {0, 0, 1}, -100, 1).is_in_domain);
  EXPECT_FALSE(grid.find({0, 0, 0}, {NAN, 0, 1}, -100, 1).is_in_domain);
  EXPECT_GT(grid.at({0, 0, -2}), 0.39);  // the cut
}

TEST(RayTerms, PixelsHeldOutAreTheSamePlacesAtEachSize) {
  const HeadPhoto photo = photo_of(kCodes, camera_at(6, 900, 0.1));
  std::vector<std::vector<std::array<int, 2>>> squares(2);
  for (size_t level = 0; level < 2; ++level) {
    FitRayOptions options;
    options.side_px = level == 0 ? 48 : 144;
    FitRays rays;
    add_fit_rays(photo, 0, options, rays);
    const size_t all = rays.fitted.size() + rays.held_out.size();
    EXPECT_NEAR(double(rays.held_out.size()) / double(all), 0.05, 0.03);
    EXPECT_LT(double(all), 0.95 * options.side_px * options.side_px);
    EXPECT_NEAR(rays.cells_per_ray, 2304.0 / (options.side_px * options.side_px), 1e-12);
    for (const FitRay& ray : rays.held_out) {
      const maq::Point at = photo.seen.photo_to_crop({double(ray.x_px) + 320.5, double(ray.y_px) + 240.5});
      const std::array<int, 2> square = {int(at.x / 12), int(at.y / 12)};
      auto& known = squares[level];
      if (std::find(known.begin(), known.end(), square) == known.end()) known.push_back(square);
    }
    std::sort(squares[level].begin(), squares[level].end());
    int coloured = 0, pointed = 0;
    for (const FitRay& ray : rays.fitted) {
      coloured += ray.has_colour, pointed += ray.has_point;
      if (ray.has_colour) {
        EXPECT_GT(ray.matte, 0.9f);
      }
      if (ray.has_point) {
        EXPECT_GT(ray.point_sigma_dm, 0);
      }
    }
    EXPECT_GT(coloured, int(all / 8));
    EXPECT_GT(pointed, int(all / 20));
  }
  EXPECT_EQ(squares[0], squares[1]);
}

TEST(RayTerms, AdamStepsAtItsRatesAndComesToTheLeast) {
  Adam adam(3);
  const std::vector<double> rates = {0.1, 0.01, 0.1};
  std::vector<double> x = {3, -0.2, 1}, change(3);
  for (int step = 0; step < 300; ++step) {
    adam.step({1e4 * x[0], 1e-3 * x[1], 0}, rates, change);
    if (step == 0) {
      EXPECT_NEAR(change[0], -0.1, 1e-6);
      EXPECT_NEAR(change[1], 0.01, 1e-6);
    }
    for (size_t i = 0; i < 3; ++i) x[i] += change[i];
  }
  EXPECT_NEAR(x[0], 0, 0.05);
  EXPECT_NEAR(x[1], 0, 0.01);
  EXPECT_EQ(x[2], 1);
  adam.reset();
  adam.step({-1, 0, 0}, rates, change);
  EXPECT_NEAR(change[0], 0.1, 1e-6);
}

}  // namespace
}  // namespace ray_terms
