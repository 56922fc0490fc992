// Dense clouds through the C API: of photos of a wall, and of captures with a sparse cloud.
#include <gtest/gtest.h>

#include <climits>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "support/samples/api_tiny_scene.h"

namespace {

constexpr int kWidth = 96, kHeight = 72;
constexpr double kWall = 2;  // z of the wall

// A photo of the wall from (x, 0, 0), along z.
struct WallPhoto {
  WallPhoto(const maquette::Context& context, double x) {
    const double focal = 100, cx = 0.5 * (kWidth - 1), cy = 0.5 * (kHeight - 1);
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const double u = x + (column - cx) / focal * kWall, v = (row - cy) / focal * kWall;
        double grey = 128;
        for (int i = 1; i < 7; ++i) grey += 18 * std::sin(u * 11 * i + v * (29 - 9 * i) + i);
        for (int channel = 0; channel < 3; ++channel) pixels.push_back(uint8_t(grey + 3 * channel));
      }
    }
    maq_frame_desc desc;
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = MAQ_PIXEL_BGR8;
    desc.width_px = kWidth;
    desc.height_px = kHeight;
    desc.planes[0] = pixels.data();
    frame = std::make_unique<maquette::Frame>(context, desc);
    posed.struct_size = sizeof posed;
    posed.photo = frame->get();
    posed.camera.struct_size = sizeof posed.camera;
    posed.camera.intrinsics = {kWidth, kHeight, focal, focal, cx, cy, {}};
    for (const int i : {0, 4, 8}) posed.camera.rotation[i] = 1;
    posed.camera.centre[0] = x;
  }
  std::vector<uint8_t> pixels;
  std::unique_ptr<maquette::Frame> frame;
  maq_posed_photo posed{};
};

class ApiDenseClouds : public ::testing::Test {
 protected:
  ApiDenseClouds() {
    for (const double x : {0.0, -0.25, 0.25}) photos_.emplace_back(context_, x);
    for (const WallPhoto& photo : photos_) posed_.push_back(photo.posed);
    for (int i = 0; i < 100; ++i) {
      for (const double value : {-1 + 0.2 * (i % 10), -0.7 + 0.14 * (i / 10), kWall + 0.1 * (i % 7 - 3)}) {
        places_.push_back(float(value));
      }
    }
  }

  void expect_refused(const maq_point_cloud& sparse, maq_status status, const std::string& text,
                      const maq_dense_cloud_config* config = nullptr) {
    maq_dense_cloud* cloud = nullptr;
    EXPECT_EQ(maq_dense_cloud_create(context_.get(), config, posed_.data(), uint32_t(posed_.size()), &sparse, &cloud),
              status);
    EXPECT_NE(std::string(maq_last_error(context_.get())).find(text), std::string::npos)
        << maq_last_error(context_.get());
    EXPECT_EQ(cloud, nullptr);
  }

  maquette::Context context_;
  std::vector<WallPhoto> photos_;
  std::vector<maq_posed_photo> posed_;
  std::vector<float> places_;
};

TEST_F(ApiDenseClouds, PhotosOfAWallBecomePointsOnItWithItsColours) {
  const maquette::DenseCloud dense(context_, maquette::default_dense_cloud_config(), posed_,
                                   api_tiny_scene::cloud_of(places_));
  const uint8_t* rgb = nullptr;
  const maq_point_cloud points = dense.points(&rgb);
  ASSERT_GT(points.point_count, 10000u);
  EXPECT_EQ(points.up[2], 1);
  size_t on_wall = 0;
  for (uint64_t i = 0; i < points.point_count; ++i) {
    if (std::abs(points.xyz[3 * i + 2] - kWall) < 0.02 * kWall) ++on_wall;
    EXPECT_EQ(rgb[3 * i] - rgb[3 * i + 2], 6);
  }
  EXPECT_GT(double(on_wall), 0.95 * double(points.point_count));
  const auto [frame, camera] = dense.load_depth(1);
  EXPECT_EQ(frame.desc().format, MAQ_PIXEL_DEPTH32F);
  EXPECT_EQ(frame.desc().width_px, kWidth);
  EXPECT_EQ(camera.centre[0], -0.25);
  float middle = 0;
  std::memcpy(&middle, frame.desc().planes[0] + (kHeight / 2 * kWidth + kWidth / 2) * sizeof middle, sizeof middle);
  EXPECT_NEAR(middle, kWall, 0.02);
  maq_scene_builder* builder = nullptr;
  const maq_scene_build_config config = api_tiny_scene::build_config();
  ASSERT_EQ(maq_scene_builder_create(context_.get(), &config, &points, &builder), MAQ_OK);
  maq_scene_builder_destroy(builder);
}

TEST_F(ApiDenseClouds, NoPointIsMadeWhereTheMaskIsBlackAndNoMoreThanAskedFor) {
  std::vector<uint8_t> mask(size_t(kWidth) * kHeight, 255);
  std::fill_n(mask.begin(), mask.size() / 2, uint8_t(0));
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_GREY8;
  desc.width_px = kWidth;
  desc.height_px = kHeight;
  desc.planes[0] = mask.data();
  const maquette::Frame frame(context_, desc);
  for (maq_posed_photo& photo : posed_) photo.mask = frame.get();
  maq_dense_cloud_config config = maquette::default_dense_cloud_config();
  config.max_points = 500;
  const maquette::DenseCloud dense(context_, config, posed_, api_tiny_scene::cloud_of(places_));
  const maq_point_cloud points = dense.points();
  ASSERT_EQ(points.point_count, 500u);
  for (uint64_t i = 0; i < 500; ++i) EXPECT_GT(points.xyz[3 * i + 1], -0.05);
  desc.width_px = kWidth / 2;
  const maquette::Frame other(context_, desc);
  posed_[1].mask = other.get();
  expect_refused(api_tiny_scene::cloud_of(places_), MAQ_ERROR_INVALID_ARGUMENT, "48 x 72");
}

TEST_F(ApiDenseClouds, TheResultIsTheSameForAnyNumberOfThreads) {
  std::vector<float> first;
  for (const int threads : {1, 2, 5}) {
    maq_dense_cloud_config config = maquette::default_dense_cloud_config();
    config.threads = threads;
    config.max_points = 3000;
    const maquette::DenseCloud dense(context_, config, posed_, api_tiny_scene::cloud_of(places_));
    const maq_point_cloud points = dense.points();
    const std::vector<float> xyz(points.xyz, points.xyz + 3 * points.point_count);
    if (first.empty()) first = xyz;
    EXPECT_EQ(xyz, first) << threads;
  }
}

TEST_F(ApiDenseClouds, InputThatCannotHaveDepthIsToldWhy) {
  const maq_point_cloud sparse = api_tiny_scene::cloud_of(places_);
  maq_point_cloud few = sparse;
  few.point_count = 11;
  expect_refused(few, MAQ_ERROR_NOT_FOUND, "12 points");
  few.point_count = 0;
  few.xyz = nullptr;
  expect_refused(few, MAQ_ERROR_NOT_FOUND, "12 points");
  const float x = places_[30];
  places_[30] = std::numeric_limits<float>::quiet_NaN();
  expect_refused(sparse, MAQ_ERROR_INVALID_ARGUMENT, "sparse.xyz[10] is not finite");
  places_[30] = x;
  for (maq_posed_photo& photo : posed_) photo.camera.centre[0] = 0;
  expect_refused(sparse, MAQ_ERROR_NOT_FOUND, "another place");
  posed_.resize(1);
  expect_refused(sparse, MAQ_ERROR_NOT_FOUND, "another photo");
  posed_[0].camera.centre[1] = std::numeric_limits<double>::quiet_NaN();
  expect_refused(sparse, MAQ_ERROR_INVALID_ARGUMENT, "photos[0].camera");
  posed_[0].camera.centre[1] = 0;
  posed_[0].camera.intrinsics.width_px = 50;
  expect_refused(sparse, MAQ_ERROR_INVALID_ARGUMENT, "96 x 72");
  posed_[0].struct_size = 4;
  expect_refused(sparse, MAQ_ERROR_INVALID_ARGUMENT, "photos[0].struct_size");
  posed_.clear();
  posed_.push_back(photos_[0].posed);
  posed_[0].photo = nullptr;
  expect_refused(sparse, MAQ_ERROR_INVALID_ARGUMENT, "photos[0].photo is NULL");
}

TEST_F(ApiDenseClouds, AProgressCallbackHearsEachPhotoAndCancels) {
  struct Calls {
    int count = 0, last = INT_MAX;
    double done = 0;
  } calls;
  maq_dense_cloud_config config = maquette::default_dense_cloud_config();
  config.progress_user_data = &calls;
  config.progress_callback = [](void* user_data, double done, const char* what) -> int32_t {
    Calls& to = *static_cast<Calls*>(user_data);
    EXPECT_GE(done, to.done);
    EXPECT_GT(std::string(what).size(), 5u);
    to.done = done;
    return ++to.count < to.last ? 1 : 0;
  };
  const maq_point_cloud sparse = api_tiny_scene::cloud_of(places_);
  const maquette::DenseCloud dense(context_, config, posed_, sparse);
  EXPECT_GE(calls.count, 6);
  EXPECT_GT(calls.done, 0.9);
  const int all = calls.count;
  for (const int last : {1, 3, all}) {
    calls = {0, last, 0};
    expect_refused(sparse, MAQ_CANCELLED, "cancelled", &config);
    EXPECT_EQ(calls.count, last);
  }
}

}  // namespace
