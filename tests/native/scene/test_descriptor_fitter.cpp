// Photos and a cloud to fitted points: against torch, in any order, cancelled, and with invalid input.
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "scene/assembly/descriptor_fitter.h"
#include "support/expect_error.h"
#include "support/peak_memory.h"
#include "support/samples/tiny_scene.h"

namespace {

using maq::FittedPoints;
using maq::kBasis;
using maq::kFeatures;

maq::FittingOptions as_in_the_reference() {
  maq::FittingOptions options;
  options.visibility_scale = 0.5;
  return options;
}

struct Photo {
  maq::Frame frame;
  std::vector<uint8_t> valid;
  maq::PinholeCamera camera;
};

class DescriptorFitter : public testing::Test {
 protected:
  DescriptorFitter() : capture_(tiny_scene::capture()), networks_(tiny_scene::networks()) {
    for (const maq::CaptureView& view : capture_.views) {
      if (view.is_held_out) continue;
      photos_.emplace_back();
      maq::load_view(view, photos_.back().frame, photos_.back().valid);
      photos_.back().camera = view.camera;
    }
  }

  maq::DescriptorFitter fitter(const maq::FittingOptions& options = as_in_the_reference()) {
    return {capture_.cloud, capture_.up, *networks_, options};
  }
  size_t add(maq::DescriptorFitter& fitter, size_t photo) {
    return fitter.add_view(photos_[photo].frame.image, photos_[photo].valid.data(), photos_[photo].camera).value();
  }
  FittedPoints built(const std::vector<size_t>& order, const maq::FittingOptions& options = as_in_the_reference()) {
    maq::DescriptorFitter made = fitter(options);
    for (const size_t photo : order) add(made, photo);
    return made.finish();
  }

  // The index in `points` of each point of the cloud, SIZE_MAX for those that are not there.
  std::vector<size_t> indices_in(const FittedPoints& points) const {
    std::vector<size_t> indices(capture_.cloud.count(), SIZE_MAX);
    for (size_t i = 0; i < points.count(); ++i) {
      for (size_t k = 0; k < capture_.cloud.count(); ++k) {
        if (points.x[i] == capture_.cloud.x[k] && points.y[i] == capture_.cloud.y[k] &&
            points.z[i] == capture_.cloud.z[k]) {
          indices[k] = i;
        }
      }
    }
    return indices;
  }

  void expect_the_same(const FittedPoints& a, const FittedPoints& b, float tolerance) {
    ASSERT_EQ(a.count(), b.count());
    EXPECT_EQ(a.never_seen, b.never_seen);
    const std::vector<size_t> in_a = indices_in(a), in_b = indices_in(b);
    for (size_t k = 0; k < in_a.size(); ++k) {
      ASSERT_EQ(in_a[k] == SIZE_MAX, in_b[k] == SIZE_MAX);
      if (in_a[k] == SIZE_MAX) continue;
      EXPECT_EQ(a.views[in_a[k]], b.views[in_b[k]]);
      EXPECT_NEAR(a.view_dependence[in_a[k]], b.view_dependence[in_b[k]], tolerance);
      for (size_t c = 0; c < kFeatures; ++c) {
        EXPECT_NEAR(a.constant_terms[in_a[k] * kFeatures + c], b.constant_terms[in_b[k] * kFeatures + c], tolerance);
      }
      for (size_t c = 0; c < kBasis * kFeatures; ++c) {
        EXPECT_NEAR(a.linear_terms[in_a[k] * kBasis * kFeatures + c], b.linear_terms[in_b[k] * kBasis * kFeatures + c],
                    tolerance);
      }
    }
  }

  maq::Capture capture_;
  std::unique_ptr<maq::SceneNetworks> networks_;
  std::vector<Photo> photos_;
};

// Features are some 1 large. Photos are rotated and sampled in float on both sides, in another order.
TEST_F(DescriptorFitter, AgreesWithTorch) {
  const FittedPoints points = built({0, 1, 2, 3});
  const auto expected = tiny_scene::expected_descriptors();
  const std::vector<size_t> indices = indices_in(points);
  ASSERT_EQ(points.count(), expected.size());
  EXPECT_EQ(points.never_seen, capture_.cloud.count() - expected.size());
  EXPECT_EQ(points.singular, 0u);
  constexpr float kTolerance = 1e-5f;
  size_t view_dependent = 0;
  for (const tiny_scene::Descriptor& expected_point : expected) {
    const size_t at = indices[expected_point.index];
    ASSERT_NE(at, SIZE_MAX) << "point " << expected_point.index << " is seen";
    EXPECT_EQ(points.views[at], expected_point.views);
    for (size_t c = 0; c < kFeatures; ++c)
      EXPECT_NEAR(points.constant_terms[at * kFeatures + c], expected_point.constant_terms[c], kTolerance);
    for (size_t c = 0; c < kBasis * kFeatures; ++c) {
      EXPECT_NEAR(points.linear_terms[at * kBasis * kFeatures + c], expected_point.linear_terms[c], kTolerance);
    }
    EXPECT_NEAR(points.view_dependence[at], expected_point.view_dependence, kTolerance);
    view_dependent += expected_point.view_dependence > 0.01f ? 1 : 0;
  }
  EXPECT_GT(view_dependent, expected.size() / 4) << "the reference must be view-dependent";
  const std::array<float, 3> background = tiny_scene::expected_background();
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(points.background[c], background[c], kTolerance);
}

TEST_F(DescriptorFitter, TheOrderOfPhotosChangesRoundingAlone) {
  expect_the_same(built({0, 1, 2, 3}), built({3, 1, 0, 2}), 1e-5f);
}

TEST_F(DescriptorFitter, FinishingInLessMemoryGivesTheSameAndAnEmptyFitter) {
  maq::DescriptorFitter made = fitter();
  add(made, 0);
  add(made, 2);
  expect_the_same(made.finish_and_forget(), built({0, 2}), 0);
  EXPECT_EQ(made.views(), 0u);
  EXPECT_EQ(made.seen_points(), 0u);
  add(made, 1);
  expect_the_same(made.finish(), built({1}), 0);
}

TEST_F(DescriptorFitter, PixelsOutsideOfTheMaskAreIgnored) {
  maq::DescriptorFitter whole = fitter(), half = fitter(), none = fitter();
  const size_t all = add(whole, 0);
  std::vector<uint8_t> left(photos_[0].valid.size());
  for (size_t i = 0; i < left.size(); ++i) left[i] = i % 72 < 36 ? 255 : 0;
  const auto seen = half.add_view(photos_[0].frame.image, left.data(), photos_[0].camera);
  EXPECT_GT(seen.value(), all / 5);
  EXPECT_LT(seen.value(), all * 4 / 5);
  const FittedPoints points = half.finish();
  for (size_t i = 0; i < points.count(); ++i) {
    const double position[3] = {points.x[i] + points.origin[0], points.y[i] + points.origin[1],
                                points.z[i] + points.origin[2]};
    double seen_as[3] = {};
    for (size_t row = 0; row < 3; ++row) {
      for (size_t k = 0; k < 3; ++k) {
        seen_as[row] += photos_[0].camera.rotation[3 * row + k] * (position[k] - photos_[0].camera.centre[k]);
      }
    }
    EXPECT_LT(photos_[0].camera.fx_px * seen_as[0] / seen_as[2] + photos_[0].camera.cx_px, 35.5);
  }
  const std::vector<uint8_t> blank(left.size(), 0);
  EXPECT_EQ(none.add_view(photos_[0].frame.image, blank.data(), photos_[0].camera).value(), 0u);
}

// Whenever it is cancelled, and from whichever thread, the fitter is as it was.
TEST_F(DescriptorFitter, ACancelledPhotoChangesNothing) {
  const FittedPoints before = built({0, 1});
  std::vector<double> steps;
  {
    maq::DescriptorFitter made = fitter();
    made.add_view(photos_[0].frame.image, nullptr, photos_[0].camera, [&](double done, const std::string& what) {
      EXPECT_FALSE(what.empty());
      steps.push_back(done);
      return true;
    });
  }
  ASSERT_GE(steps.size(), 3u);
  EXPECT_TRUE(std::is_sorted(steps.begin(), steps.end()));
  for (size_t last = 1; last <= steps.size(); ++last) {
    for (const bool by_flag : {false, true}) {
      maq::DescriptorFitter made = fitter();
      add(made, 0);
      add(made, 1);
      size_t step = 0;
      const auto cancelling = [&](double, const std::string&) {
        if (++step < last) return true;
        if (!by_flag) return false;
        std::thread([&] { made.cancel(); }).join();
        return true;
      };
      EXPECT_FALSE(made.add_view(photos_[2].frame.image, nullptr, photos_[2].camera, cancelling).has_value());
      EXPECT_EQ(step, last);
      EXPECT_EQ(made.views(), 2u);
      expect_the_same(made.finish(), before, 0);
      add(made, 2);
      expect_the_same(made.finish(), built({0, 1, 2}), 0);
    }
  }
}

TEST_F(DescriptorFitter, UpAlongTheViewIsLikeNoRotation) {
  maq::PinholeCamera down = photos_[0].camera;
  down.rotation = {1, 0, 0, 0, -1, 0, 0, 0, -1};
  down.centre = {0, 0, 3};
  maq::DescriptorFitter along(capture_.cloud, {0, 0, 1}, *networks_, as_in_the_reference());
  maq::DescriptorFitter across(capture_.cloud, {0, 1, 0}, *networks_, as_in_the_reference());
  EXPECT_GT(along.add_view(photos_[0].frame.image, nullptr, down).value(), 50u);
  across.add_view(photos_[0].frame.image, nullptr, down);
  expect_the_same(along.finish(), across.finish(), 0);
}

// A wall of points that fills the photos of cameras side by side: each photo sees other ones.
maq::PointCloud wall(size_t across, size_t down) {
  maq::PointCloud cloud;
  cloud.reserve(across * down, false);
  for (size_t row = 0; row < down; ++row) {
    for (size_t column = 0; column < across; ++column) cloud.add(double(column), double(row), 100);
  }
  return cloud;
}

// As many points as all threads have some of.
TEST_F(DescriptorFitter, ThreadsChangeNothing) {
  constexpr int kSide = 224;
  maq::Frame photo;
  uint8_t* pixels = photo.allocate_bgr(kSide, kSide);
  for (int i = 0; i < 3 * kSide * kSide; ++i) pixels[i] = uint8_t(i * 7919 % 251);
  const auto built_by = [&](int threads) {
    maq::FittingOptions options;
    options.threads = threads;
    maq::DescriptorFitter made(wall(300, 300), {0, -1, 0}, *networks_, options);
    maq::PinholeCamera camera;
    camera.width_px = camera.height_px = kSide;
    camera.fx_px = camera.fy_px = 110;
    for (const double left : {0.0, 10.0, 35.0}) {
      camera.centre = {left, left / 2, 0};
      made.add_view(photo.image, nullptr, camera);
    }
    return made.finish();
  };
  const FittedPoints one = built_by(1), three = built_by(3);
  EXPECT_GT(one.count(), 40000u);
  EXPECT_EQ(one.x, three.x);
  EXPECT_EQ(one.views, three.views);
  EXPECT_EQ(one.constant_terms, three.constant_terms);
  EXPECT_EQ(one.linear_terms, three.linear_terms);
  EXPECT_EQ(one.view_dependence, three.view_dependence);
}

// The extractor of this bundle is small; what the real one takes is in docs/research/scenes.md.
TEST_F(DescriptorFitter, AMillionSeenPointsTakeLessThan450MB) {
  constexpr int kWidth = 500, kHeight = 500;
  maq::PinholeCamera camera;
  camera.width_px = kWidth;
  camera.height_px = kHeight;
  camera.fx_px = camera.fy_px = 100;
  maq::Frame photo;
  std::fill_n(photo.allocate_bgr(kWidth, kHeight), 3 * kWidth * kHeight, uint8_t(90));
  constexpr size_t kAcross = 2 * kWidth, kDown = 2 * kHeight;
  size_t seen = 0;
  const double grown_mib = peak_memory_growth_mib([&] {
    maq::DescriptorFitter made(wall(kAcross, kDown), {0, -1, 0}, *networks_, {});
    for (int view = 0; view < 8; ++view) {
      camera.centre = {double(view % 2 * kWidth), double(view / 2 % 2 * kHeight), 0};
      made.add_view(photo.image, nullptr, camera);
    }
    const FittedPoints points = made.finish_and_forget();
    seen = points.count();
  });
  EXPECT_EQ(seen, kAcross * kDown);
  std::printf("%.0f MiB for %zu points\n", grown_mib, seen);
  EXPECT_LT(grown_mib * 1048576, 450e6);
}

}  // namespace
