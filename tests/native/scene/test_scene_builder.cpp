// Captures to scenes: which photos are used, how large, and what is reported.
#include "scene/assembly/build_scene.h"

#include <gtest/gtest.h>

#include <cstring>

#include "scene/capture/posed_photo.h"
#include "support/expect_error.h"
#include "support/samples/tiny_scene.h"

namespace {

using maq::Scene;

class SceneBuilder : public testing::Test {
 protected:
  SceneBuilder() : capture_(tiny_scene::capture()), networks_(tiny_scene::networks()) {
    options_.fitting.visibility_scale = 0.5;
    options_.packing = {maq::PositionFormat::kFloat32, maq::CoefficientFormat::kFloat32, 0};
  }

  maq::BuiltScene built(const maq::Capture& capture) { return maq::build_scene(capture, networks_, options_).value(); }
  // A scene of these views of the capture, held out or not.
  Scene built_of(const std::vector<size_t>& views) {
    maq::DescriptorFitter fitter(capture_.cloud, capture_.up, *networks_, options_.fitting);
    for (const size_t view : views) {
      maq::PosedView photo;
      photo.load(capture_.views[view], options_.long_side_px);
      fitter.add_view(photo.image(), photo.valid(), photo.camera());
    }
    return make_scene(fitter.finish(), options_.packing);
  }
  // The views that are not held out.
  std::vector<size_t> usable() const {
    std::vector<size_t> views;
    for (size_t i = 0; i < capture_.views.size(); ++i) {
      if (!capture_.views[i].is_held_out) views.push_back(i);
    }
    return views;
  }
  void expect_refused(maq_status status, const char* text, const maq::Capture& capture) {
    expect_error(status, text, [&] { maq::build_scene(capture, networks_, options_); });
  }

  maq::Capture capture_;
  std::shared_ptr<maq::SceneNetworks> networks_;
  maq::SceneBuildOptions options_;
};

void expect_same(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.points, b.points);
  ASSERT_EQ(a.view_dependent, b.view_dependent);
  EXPECT_EQ(a.background, b.background);
  EXPECT_EQ(std::memcmp(a.positions, b.positions, positions_bytes(a)), 0);
  EXPECT_EQ(std::memcmp(a.constant_terms, b.constant_terms, constant_terms_bytes(a)), 0);
  EXPECT_EQ(std::memcmp(a.linear_terms, b.linear_terms, linear_terms_bytes(a)), 0);
}

TEST_F(SceneBuilder, CapturesAreBuiltWithoutWhatIsHeldOut) {
  double last = -1;
  const auto progress = [&](double done, const std::string&) {
    EXPECT_GE(done, last);
    last = done;
    return true;
  };
  const maq::BuiltScene all = maq::build_scene(capture_, networks_, options_, progress).value();
  EXPECT_EQ(last, 1);
  EXPECT_EQ(all.stats.views, 4u);
  EXPECT_EQ(all.stats.unused_views, 0u);
  EXPECT_EQ(all.stats.cloud_points, capture_.cloud.count());
  EXPECT_EQ(all.stats.seen_points, all.scene.points);
  EXPECT_GT(all.stats.load_ms, 0);
  EXPECT_GT(all.stats.fitting.extract_ms, 0);
  EXPECT_GT(all.stats.pack_ms, 0);
  EXPECT_TRUE(all.dropped.empty());
  EXPECT_EQ(all.scene.networks_sha256, networks_->sha256());
  const std::vector<size_t> views = usable();
  ASSERT_EQ(views.size(), 4u);
  expect_same(all.scene, built_of(views));
  options_.max_views = 2;
  expect_same(built(capture_).scene, built_of({views[0], views[2]}));
  options_.max_views = 0;
  options_.uses_held_out = true;
  EXPECT_EQ(built(capture_).stats.views, 5u);
}

TEST_F(SceneBuilder, PhotoByPhotoTheSceneIsTheSameAndCanGrow) {
  const std::vector<size_t> views = usable();
  maq::SceneBuilder builder(capture_.cloud, capture_.up, networks_, options_);
  for (const size_t view : {views[0], views[1]}) EXPECT_GT(builder.add_view(capture_.views[view]).value(), 0u);
  expect_same(builder.finish(), built_of({views[0], views[1]}));
  for (const size_t view : {views[2], views[3]}) builder.add_view(capture_.views[view]);
  EXPECT_EQ(builder.stats().views, 4u);
  expect_same(builder.finish(), built_of(views));
  expect_same(builder.finish_and_forget(), built_of(views));
  EXPECT_EQ(builder.stats().views, 0u);
}

TEST_F(SceneBuilder, LargerCloudsAreThinnedOut) {
  options_.max_points = capture_.cloud.count() / 2;
  const maq::BuiltScene half = built(capture_);
  EXPECT_EQ(half.stats.cloud_points, options_.max_points);
  thin_out(capture_.cloud, options_.max_points);
  expect_same(half.scene, built_of(usable()));
}

TEST_F(SceneBuilder, PhotosOfACaptureAreShrunkToALongSide) {
  const uint32_t whole = built(capture_).scene.points;
  options_.long_side_px = 36;
  const maq::BuiltScene small = built(capture_);
  EXPECT_GT(small.scene.points, 50u);
  EXPECT_LT(small.scene.points, whole);
}

TEST_F(SceneBuilder, PhotosOfACaptureThatCannotBeReadAreDroppedAndCounted) {
  maq::Capture capture = capture_;
  const std::vector<size_t> views = usable();
  capture.views[views[0]].image_path = "nowhere.png";
  const maq::BuiltScene left = built(capture);
  EXPECT_EQ(left.stats.views, 3u);
  EXPECT_EQ(left.stats.unused_views, 1u);
  ASSERT_EQ(left.dropped.size(), 1u);
  EXPECT_EQ(left.dropped[0].reason, maq::kPhotosMissing);
  expect_same(left.scene, built_of({views[1], views[2], views[3]}));
  for (maq::CaptureView& view : capture.views) view.image_path = "nowhere.png";
  expect_refused(MAQ_ERROR_UNREADABLE, "None of the photos can be used: 4 photos that are not in their folder",
                 capture);
}

TEST_F(SceneBuilder, ChoicesThatLeaveNoPhotoAreASentence) {
  maq::Capture held_out = capture_;
  for (maq::CaptureView& view : held_out.views) view.is_held_out = true;
  expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "All of the capture's 5 photos are held out", held_out);
  options_.long_side_px = -1;
  expect_refused(MAQ_ERROR_INVALID_ARGUMENT, "long side", capture_);
}

TEST_F(SceneBuilder, ACancelledCaptureIsNothing) {
  const auto cancelling = [](double done, const std::string&) { return done < 0.5; };
  EXPECT_FALSE(maq::build_scene(capture_, networks_, options_, cancelling).has_value());
}

}  // namespace
