// Scenes built through the C API: of a capture, and of an app's own cloud and photos.
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>

#include "support/samples/api_tiny_scene.h"

namespace {

using api_tiny_scene::build_config;
using api_tiny_scene::camera_at;
using api_tiny_scene::cloud_of;
using api_tiny_scene::kCapture;
using api_tiny_scene::Photo;

class ApiSceneBuilding : public ::testing::Test {
 protected:
  void expect_error(maq_status actual, maq_status expected, const void* handle, const std::string& text) {
    EXPECT_EQ(actual, expected) << maq_last_error(handle);
    EXPECT_NE(std::string(maq_last_error(handle)).find(text), std::string::npos) << maq_last_error(handle);
  }

  void expect_refused(const maq_point_cloud& cloud, const maq_scene_build_config& config, maq_status status,
                      const std::string& text) {
    maq_scene_builder* builder = nullptr;
    expect_error(maq_scene_builder_create(context_.get(), &config, &cloud, &builder), status, context_.get(), text);
    EXPECT_EQ(builder, nullptr);
  }

  maquette::Context context_;
  std::vector<float> places_ = api_tiny_scene::ball(2000);
};

struct Progress {
  std::vector<double> done;
  std::vector<std::string> what;
  size_t ends_at = SIZE_MAX;

  static int32_t call(void* user_data, double done, const char* what) {
    Progress& self = *static_cast<Progress*>(user_data);
    self.done.push_back(done);
    self.what.push_back(what);
    return self.done.size() <= self.ends_at ? 1 : 0;
  }
};

TEST_F(ApiSceneBuilding, ACaptureBecomesASceneAndTellsHowItGoes) {
  const maquette::Capture capture(context_, kCapture);
  Progress progress;
  maq_scene_build_config config = build_config();
  config.progress_callback = Progress::call;
  config.progress_user_data = &progress;
  const maquette::Scene scene(context_, config, capture);
  const maq_scene_build_stats stats = scene.build_stats();
  EXPECT_EQ(stats.view_count, 4u) << "one is held out";
  EXPECT_EQ(stats.unused_view_count, 0u);
  EXPECT_EQ(stats.cloud_point_count, capture.info().point_count);
  EXPECT_EQ(stats.seen_point_count, scene.info().point_count);
  EXPECT_GT(stats.seen_point_count, stats.cloud_point_count / 4);
  for (const double ms :
       {stats.load_ms, stats.visibility_ms, stats.extract_ms, stats.accumulate_ms, stats.solve_ms, stats.pack_ms}) {
    EXPECT_GT(ms, 0);
  }
  ASSERT_GT(progress.done.size(), 4u);
  EXPECT_TRUE(std::is_sorted(progress.done.begin(), progress.done.end()));
  EXPECT_EQ(progress.done.back(), 1);
  EXPECT_EQ(progress.what[0].rfind("Photo 1 of 4", 0), 0u) << progress.what[0];

  config.use_held_out = 1;
  EXPECT_EQ(maquette::Scene(context_, config, capture).build_stats().view_count, 5u);
  config.max_views = 2;
  config.max_points = 100;
  const maquette::Scene small(context_, config, capture);
  EXPECT_EQ(small.build_stats().view_count, 2u);
  EXPECT_EQ(small.build_stats().cloud_point_count, 100u);
  EXPECT_LE(small.info().point_count, 100u);
}

TEST_F(ApiSceneBuilding, TheCallbackCancelsAtEveryCall) {
  const maquette::Capture capture(context_, kCapture);
  Progress whole;
  maq_scene_build_config config = build_config();
  config.progress_callback = Progress::call;
  config.progress_user_data = &whole;
  maquette::Scene(context_, config, capture);
  const auto progress_of = config.progress_callback;
  config.progress_callback = [](void*, double, const char*) -> int32_t { throw std::runtime_error("Own error."); };
  maq_scene* none = nullptr;
  EXPECT_EQ(maq_scene_build(context_.get(), &config, capture.get(), &none), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_STREQ(maq_last_error(nullptr),
               "maq_scene_build: config.progress_callback threw an exception (Own error.); functions that the library "
               "calls must not.");
  config.progress_callback = progress_of;
  for (size_t calls = 0; calls + 1 < whole.done.size(); ++calls) {
    Progress progress;
    progress.ends_at = calls;
    config.progress_user_data = &progress;
    maq_scene* scene = nullptr;
    EXPECT_EQ(maq_scene_build(context_.get(), &config, capture.get(), &scene), MAQ_CANCELLED) << calls;
    EXPECT_EQ(scene, nullptr);
    EXPECT_EQ(progress.done.size(), calls + 1) << "it is not asked again";
  }
}

TEST_F(ApiSceneBuilding, AnAppsOwnCloudAndPhotosGiveTheSceneOfTheCapture) {
  const maquette::Capture capture(context_, kCapture);
  const maq_scene_info expected = maquette::Scene(context_, build_config(), capture).info();
  const std::vector<float> places = api_tiny_scene::capture_places();
  maquette::SceneBuilder builder(context_, build_config(), cloud_of(places));
  for (const uint32_t i : {0u, 1u, 2u, 4u}) builder.add_view(capture.load_view(i), capture.view(i).camera);
  const maquette::Scene scene = builder.finish();
  const maq_scene_info found = scene.info();
  EXPECT_EQ(found.point_count, expected.point_count);
  EXPECT_NEAR(double(found.view_dependent_count), double(expected.view_dependent_count), 2);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(found.bounds_min[axis], expected.bounds_min[axis], 1e-4);
    EXPECT_NEAR(found.bounds_max[axis], expected.bounds_max[axis], 1e-4);
  }
  EXPECT_EQ(std::memcmp(found.networks_sha256, expected.networks_sha256, 32), 0);
  const maq_scene_build_stats stats = builder.stats();
  EXPECT_EQ(stats.view_count, 4u);
  EXPECT_EQ(stats.seen_point_count, found.point_count);
  EXPECT_EQ(stats.cloud_point_count, places.size() / 3);
  EXPECT_GT(stats.load_ms, 0);
  EXPECT_EQ(scene.build_stats().seen_point_count, stats.seen_point_count);
}

TEST_F(ApiSceneBuilding, PhotosOfEveryPixelFormatSeeTheSame) {
  maquette::SceneBuilder builder(context_, build_config(), cloud_of(places_));
  uint64_t expected = 0;
  for (const maq_pixel_format format :
       {MAQ_PIXEL_BGR8, MAQ_PIXEL_RGB8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_GREY8, MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
    const Photo photo(format);
    const uint64_t seen = builder.add_view(maquette::Frame(context_, photo.desc), camera_at(0));
    if (format == MAQ_PIXEL_BGR8) expected = seen;
    EXPECT_EQ(seen, expected) << format;
  }
  EXPECT_GT(expected, 300u);
  const Photo depth(MAQ_PIXEL_DEPTH16);
  const maquette::Frame frame(context_, depth.desc);
  const maq_pinhole_camera camera = camera_at(0);
  expect_error(maq_scene_builder_add_view(builder.get(), frame.get(), &camera, nullptr), MAQ_ERROR_UNSUPPORTED,
               builder.get(), "depth image");
  EXPECT_EQ(builder.stats().view_count, 6u);
}

TEST_F(ApiSceneBuilding, DistortedCamerasAreUndistorted) {
  maquette::SceneBuilder builder(context_, build_config(), cloud_of(places_));
  const Photo photo;
  const maquette::Frame frame(context_, photo.desc);
  maq_pinhole_camera camera = camera_at(0);
  camera.intrinsics.distortion[0] = -0.1;
  EXPECT_GT(builder.add_view(frame, camera), 300u);
  camera.intrinsics.distortion[0] = -1000;
  expect_error(maq_scene_builder_add_view(builder.get(), frame.get(), &camera, nullptr), MAQ_ERROR_INVALID_ARGUMENT,
               builder.get(), "not invertible");
  camera.intrinsics.distortion[0] = 0;
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    camera.intrinsics.distortion[7] = value;
    expect_error(maq_scene_builder_add_view(builder.get(), frame.get(), &camera, nullptr), MAQ_ERROR_INVALID_ARGUMENT,
                 builder.get(), "camera.intrinsics.distortion[7]");
  }
  EXPECT_EQ(builder.stats().view_count, 1u);
}

TEST_F(ApiSceneBuilding, ViewsCanBeAddedAfterAScene) {
  maquette::SceneBuilder builder(context_, build_config(), cloud_of(places_));
  const Photo photo;
  const uint64_t seen = builder.add_view(maquette::Frame(context_, photo.desc), camera_at(0));
  const maquette::Scene first = builder.finish();
  EXPECT_EQ(first.info().point_count, seen);
  EXPECT_EQ(first.info().view_dependent_count, 0u) << "one photo says nothing of other sides";
  builder.add_view(maquette::Frame(context_, photo.desc), camera_at(3));
  const maquette::Scene second = builder.finish();
  EXPECT_GT(second.info().point_count, seen + 300);
  EXPECT_EQ(first.info().point_count, seen);
}

TEST_F(ApiSceneBuilding, AViewThatSeesNothingIsNoErrorAndASceneOfSuchIsOne) {
  maquette::SceneBuilder builder(context_, build_config(), cloud_of(places_));
  const Photo photo;
  maq_pinhole_camera away = camera_at(0);
  away.centre[0] = -3;
  EXPECT_EQ(builder.add_view(maquette::Frame(context_, photo.desc), away), 0u);
  EXPECT_EQ(builder.stats().view_count, 0u);
  EXPECT_EQ(builder.stats().unused_view_count, 1u);
  maq_scene* scene = nullptr;
  expect_error(maq_scene_builder_finish(builder.get(), &scene), MAQ_ERROR_INVALID_ARGUMENT, builder.get(),
               "None of the photos sees a point");
  EXPECT_EQ(scene, nullptr);
}

TEST_F(ApiSceneBuilding, UpMayBeAlongTheViewAndOfAnyLength) {
  const Photo photo;
  for (const double length : {1.0, 1e-200, 1e200}) {
    maq_point_cloud cloud = cloud_of(places_);
    cloud.up[0] = length;
    cloud.up[2] = 0;
    maquette::SceneBuilder builder(context_, build_config(), cloud);
    EXPECT_GT(builder.add_view(maquette::Frame(context_, photo.desc), camera_at(0)), 300u);
    const maq_scene_info info = builder.finish().info();
    EXPECT_EQ(info.up[0], 1);
    EXPECT_EQ(info.up[2], 0);
  }
}

TEST_F(ApiSceneBuilding, CloudsThatAreNoneAreRefused) {
  maq_point_cloud cloud = cloud_of(places_);
  cloud.point_count = 0;
  expect_refused(cloud, build_config(), MAQ_ERROR_INVALID_ARGUMENT, "no points");
  cloud.xyz = nullptr;
  expect_refused(cloud, build_config(), MAQ_ERROR_INVALID_ARGUMENT, "no points");
  cloud.point_count = 1;
  expect_refused(cloud, build_config(), MAQ_ERROR_INVALID_ARGUMENT, "cloud.xyz is NULL");
  cloud = cloud_of(places_);
  cloud.point_count = 30'000'001;
  expect_refused(cloud, build_config(), MAQ_ERROR_UNSUPPORTED, "30000001 points, over the limit");
  cloud.point_count = UINT64_MAX;
  expect_refused(cloud, build_config(), MAQ_ERROR_UNSUPPORTED, "over the limit");
  cloud = cloud_of(places_);
  cloud.up[2] = 0;
  expect_refused(cloud, build_config(), MAQ_ERROR_INVALID_ARGUMENT, "no direction");
  cloud.up[2] = std::numeric_limits<double>::quiet_NaN();
  expect_refused(cloud, build_config(), MAQ_ERROR_INVALID_ARGUMENT, "no direction");
  cloud = cloud_of(places_);
  cloud.origin[1] = std::numeric_limits<double>::infinity();
  expect_refused(cloud, build_config(), MAQ_ERROR_INVALID_ARGUMENT, "origin");
  places_[3001] = std::numeric_limits<float>::quiet_NaN();
  expect_refused(cloud_of(places_), build_config(), MAQ_ERROR_INVALID_ARGUMENT, "Point 1000");
}

TEST_F(ApiSceneBuilding, CoefficientsAreOfTheBitsAskedForAndMayAllVaryOrNone) {
  const maquette::Capture capture(context_, kCapture);
  for (const int32_t bits : {8, 16, 32}) {
    maq_scene_build_config config = build_config();
    config.coefficient_bits = bits;
    config.min_variation = MAQ_SCENE_VARIATION_ALL;
    const maq_scene_info all = maquette::Scene(context_, config, capture).info();
    EXPECT_EQ(all.coefficient_bits, bits);
    EXPECT_GT(all.view_dependent_count, 0u);
    for (const double least : {1e3, std::numeric_limits<double>::infinity()}) {
      config.min_variation = least;
      const maq_scene_info none = maquette::Scene(context_, config, capture).info();
      EXPECT_EQ(none.view_dependent_count, 0u);
      EXPECT_EQ(none.point_count, all.point_count);
    }
  }
}

TEST_F(ApiSceneBuilding, CamerasAndPhotosThatDoNotFitAreRefusedAndChangeNothing) {
  maquette::SceneBuilder builder(context_, build_config(), cloud_of(places_));
  const Photo photo;
  const maquette::Frame frame(context_, photo.desc);
  const auto expect = [&](maq_status status, const std::string& text, auto change) {
    maq_pinhole_camera camera = camera_at(0);
    change(camera);
    uint64_t seen = 77;
    expect_error(maq_scene_builder_add_view(builder.get(), frame.get(), &camera, &seen), status, builder.get(), text);
    EXPECT_EQ(seen, 77u);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect(MAQ_ERROR_INVALID_ARGUMENT, "its camera is for 65 x 48",
         [](auto& camera) { camera.intrinsics.width_px = 65; });
  expect(MAQ_ERROR_IMAGE_SIZE, "0", [](auto& camera) { camera.intrinsics.height_px = 0; });
  expect(MAQ_ERROR_INVALID_ARGUMENT, "focal lengths", [](auto& camera) { camera.intrinsics.fx_px = 0; });
  expect(MAQ_ERROR_INVALID_ARGUMENT, "not finite", [=](auto& camera) { camera.intrinsics.cy_px = nan; });
  expect(MAQ_ERROR_INVALID_ARGUMENT, "not finite", [=](auto& camera) { camera.centre[2] = nan; });
  expect(MAQ_ERROR_INVALID_ARGUMENT, "rotation", [](auto& camera) { camera.rotation[1] = 2; });
  expect(MAQ_ERROR_INVALID_ARGUMENT, "mirrors", [](auto& camera) {
    for (int i = 0; i < 3; ++i) camera.rotation[i] *= -1;
  });
  expect(MAQ_ERROR_INVALID_ARGUMENT, "camera.struct_size", [](auto& camera) { camera.struct_size = 0; });
  // With a distortion too: nothing is undistorted by numbers that are not finite.
  expect(MAQ_ERROR_INVALID_ARGUMENT, "focal lengths", [](auto& camera) {
    camera.intrinsics.fy_px = -3;
    camera.intrinsics.distortion[0] = 0.1;
  });
  EXPECT_EQ(builder.stats().view_count, 0u);
  EXPECT_EQ(builder.stats().seen_point_count, 0u);
}

TEST_F(ApiSceneBuilding, PhotosOverTheNetworksLimitNeedALongSide) {
  maq_scene_build_config config = build_config();
  config.long_side_px = MAQ_SCENE_LONG_SIDE_FULL;
  const Photo large(MAQ_PIXEL_GREY8, 4096, 2112);
  const maquette::Frame frame(context_, large.desc);
  const maq_pinhole_camera camera = camera_at(0, 4096, 2112);
  maquette::SceneBuilder whole(context_, config, cloud_of(places_));
  expect_error(maq_scene_builder_add_view(whole.get(), frame.get(), &camera, nullptr), MAQ_ERROR_IMAGE_SIZE,
               whole.get(), "4096");
  config.long_side_px = 96;
  maquette::SceneBuilder shrunk(context_, config, cloud_of(places_));
  EXPECT_GT(shrunk.add_view(frame, camera), 300u);
}

TEST_F(ApiSceneBuilding, TheLimitOfMemoryIsAStatus) {
  maq_scene_build_config config = build_config();
  config.max_memory_bytes = 1000;
  expect_refused(cloud_of(places_), config, MAQ_ERROR_OUT_OF_MEMORY, "over the limit");
  config.max_memory_bytes = 4 * 2000 + 100;
  maquette::SceneBuilder builder(context_, config, cloud_of(places_));
  const Photo photo;
  const maquette::Frame frame(context_, photo.desc);
  const maq_pinhole_camera camera = camera_at(0);
  expect_error(maq_scene_builder_add_view(builder.get(), frame.get(), &camera, nullptr), MAQ_ERROR_OUT_OF_MEMORY,
               builder.get(), "thinner");
}

TEST_F(ApiSceneBuilding, WrongNetworksAreAStatus) {
  maq_scene_build_config config = build_config();
  config.model.bundle_path = "/no/such/bundle";
  expect_refused(cloud_of(places_), config, MAQ_ERROR_NOT_FOUND, "/no/such/bundle");
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
  expect_refused(cloud_of(places_), config, MAQ_ERROR_UNSUPPORTED, "the task scenes");
  maq_context_config without = maquette::default_context_config();
  without.onnxruntime_library = "/no/such/libonnxruntime.so.1";
  const maquette::Context context(without);
  const maq_point_cloud cloud = cloud_of(places_);
  config = build_config();
  maq_scene_builder* builder = nullptr;
  EXPECT_EQ(maq_scene_builder_create(context.get(), &config, &cloud, &builder), MAQ_ERROR_RUNTIME_LIBRARY);
}

TEST_F(ApiSceneBuilding, CapturesOfWhichNoPhotoIsLeftAreAStatus) {
  const TempFolder folder;
  std::filesystem::copy(kCapture, folder.file("c"), std::filesystem::copy_options::recursive);
  const maquette::Capture capture(context_, folder.file("c"));
  maq_scene_build_config config = build_config();
  std::filesystem::remove(folder.file("c/images/0.png"));
  const maq_scene_build_stats stats = maquette::Scene(context_, config, capture).build_stats();
  EXPECT_EQ(stats.view_count, 3u);
  EXPECT_EQ(stats.unused_view_count, 1u);
  for (const int i : {1, 2, 4}) write_text(folder.file("c/images/" + std::to_string(i) + ".png"), "no picture");
  maq_scene* scene = nullptr;
  expect_error(maq_scene_build(context_.get(), &config, capture.get(), &scene), MAQ_ERROR_UNREADABLE, context_.get(),
               "None of the photos can be used");
  EXPECT_EQ(scene, nullptr);
}

TEST_F(ApiSceneBuilding, AnotherThreadCancelsTheViewThatRuns) {
  struct Waiting {
    std::atomic<bool> is_inside{false}, may_go_on{false};
  } waiting;
  maq_scene_build_config config = build_config();
  config.progress_callback = [](void* user_data, double, const char*) -> int32_t {
    Waiting& self = *static_cast<Waiting*>(user_data);
    self.is_inside = true;
    while (!self.may_go_on) std::this_thread::yield();
    return 1;
  };
  config.progress_user_data = &waiting;
  maquette::SceneBuilder builder(context_, config, cloud_of(places_));
  const Photo photo;
  const maquette::Frame frame(context_, photo.desc);
  const maq_pinhole_camera camera = camera_at(0);
  maq_status status = MAQ_OK;
  std::thread adding([&] { status = maq_scene_builder_add_view(builder.get(), frame.get(), &camera, nullptr); });
  while (!waiting.is_inside) std::this_thread::yield();
  builder.cancel();
  waiting.may_go_on = true;
  adding.join();
  EXPECT_EQ(status, MAQ_CANCELLED);
  EXPECT_EQ(builder.stats().seen_point_count, 0u);
  EXPECT_GT(builder.add_view(frame, camera), 300u) << "the next is not cancelled";
  builder.cancel();
  EXPECT_EQ(maq_scene_builder_add_view(builder.get(), frame.get(), &camera, nullptr), MAQ_CANCELLED)
      << "a cancel before it is of the next";
}

TEST_F(ApiSceneBuilding, ScenesAreBuiltSideBySideOfOneCapture) {
  const maquette::Capture capture(context_, kCapture);
  const uint64_t expected = maquette::Scene(context_, build_config(), capture).info().point_count;
  std::vector<std::thread> threads;
  for (int t = 0; t < 2; ++t) {
    threads.emplace_back([&] {
      maq_scene_build_config config = build_config();
      config.model.threads = 2;
      EXPECT_EQ(maquette::Scene(context_, config, capture).info().point_count, expected);
      EXPECT_EQ(capture.load_view(1).desc().width_px, 72);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(ApiSceneBuilding, ABuilderOutlivesWhatItWasMadeOf) {
  std::unique_ptr<maquette::SceneBuilder> builder;
  std::unique_ptr<maquette::Frame> frame;
  {
    const maquette::Context context;
    const std::string bundle = api_tiny_scene::kBundle;
    maq_scene_build_config config = build_config();
    config.model.bundle_path = bundle.c_str();
    const std::vector<float> places = places_;
    builder = std::make_unique<maquette::SceneBuilder>(context, config, cloud_of(places));
    frame = std::make_unique<maquette::Frame>(maquette::Capture(context, kCapture).load_view(0));
  }
  EXPECT_GT(builder->add_view(*frame, camera_at(0, 72, 56)), 300u);
  maquette::Scene scene = builder->finish();
  builder.reset();
  EXPECT_GT(scene.info().point_count, 300u);
}

TEST_F(ApiSceneBuilding, WithoutAConfigTheInstalledBundleIsUsed) {
  const maq_point_cloud cloud = cloud_of(places_);
  maq_scene_builder* builder = nullptr;
  ASSERT_EQ(maq_scene_builder_create(context_.get(), nullptr, &cloud, &builder), MAQ_OK) << maq_last_error(nullptr);
  maq_scene_builder_destroy(builder);
}

TEST_F(ApiSceneBuilding, FoldersAndPathsThatAreEmptyAreAStatus) {
  const maquette::Capture opened(context_, kCapture);
  maq_capture* capture = nullptr;
  EXPECT_EQ(maq_capture_open(context_.get(), "", &capture), MAQ_ERROR_NOT_FOUND);
  maq_scene* scene = nullptr;
  EXPECT_EQ(maq_scene_open(context_.get(), "", &scene), MAQ_ERROR_NOT_FOUND);
  maq_scene_build_config config = build_config();
  config.model.bundle_path = "";
  EXPECT_EQ(maq_scene_build(context_.get(), &config, opened.get(), &scene), MAQ_ERROR_NOT_FOUND);
}

// Layouts that apps rely on.
static_assert(sizeof(void*) != 8 ||
                  (sizeof(maq_pinhole_camera) == 208 && offsetof(maq_pinhole_camera, rotation) == 112),
              "");

}  // namespace
