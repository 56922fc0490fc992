// Rendering through the C API: planes, the pool, backgrounds, sizes, wrong cameras and networks, threads.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "support/samples/api_tiny_scene.h"

namespace {

using api_tiny_scene::camera_at;
using api_tiny_scene::renderer_config;

class ApiSceneRendering : public ::testing::Test {
 protected:
  template <class T>
  static std::vector<T> plane_of(const maquette::Image& image, maq_image_plane plane, const maq_pinhole_camera& camera,
                                 int channels = 1) {
    size_t stride = 0;
    const auto* const rows = static_cast<const uint8_t*>(image.plane(plane, &stride));
    std::vector<T> values;
    for (int y = 0; y < camera.intrinsics.height_px; ++y) {
      const T* const row = reinterpret_cast<const T*>(rows + size_t(y) * stride);
      values.insert(values.end(), row, row + camera.intrinsics.width_px * channels);
    }
    return values;
  }
  static std::vector<uint8_t> bgr_of(const maquette::Image& image, const maq_pinhole_camera& camera) {
    return plane_of<uint8_t>(image, MAQ_IMAGE_PLANE_BGR, camera, 3);
  }

  void expect_refused(const maq_scene_renderer_config& config, maq_status status, const std::string& text) const {
    maq_scene_renderer* renderer = nullptr;
    EXPECT_EQ(maq_scene_renderer_create(context_.get(), &config, scene_.get(), &renderer), status) << text;
    EXPECT_NE(std::string(maq_last_error(context_.get())).find(text), std::string::npos)
        << maq_last_error(context_.get());
    EXPECT_EQ(renderer, nullptr);
  }

  maquette::Context context_;
  maquette::Scene scene_ = api_tiny_scene::ball_scene(context_);
};

TEST_F(ApiSceneRendering, GivesPlanesAndStats) {
  maquette::SceneRenderer renderer(context_, renderer_config(), scene_);
  const maq_pinhole_camera camera = camera_at(0.3, 100, 80);
  const maquette::Image image = renderer.run(camera);
  EXPECT_EQ(image.width_px(), 100);
  EXPECT_EQ(image.height_px(), 80);
  const void* none = nullptr;
  size_t no_stride = 0;
  EXPECT_EQ(maq_image_get_plane(image.get(), MAQ_IMAGE_PLANE_NORMALS, &none, &no_stride), MAQ_ERROR_INVALID_ARGUMENT);
  const std::vector<uint8_t> alpha = plane_of<uint8_t>(image, MAQ_IMAGE_PLANE_ALPHA, camera);
  const std::vector<float> depth = plane_of<float>(image, MAQ_IMAGE_PLANE_DEPTH, camera);
  const size_t middle = 40 * 100 + 50;
  EXPECT_EQ(alpha[middle], 255);
  EXPECT_NEAR(depth[middle], 2, 0.1) << "a ball of radius 1, seen from 3 away";
  EXPECT_EQ(alpha[0], 0);
  EXPECT_EQ(depth[0], 0);
  const maq_scene_render_stats stats = image.scene_stats();
  EXPECT_GT(stats.drawn_point_count, 1000u);
  EXPECT_GT(stats.shaded_point_count, 300u);
  EXPECT_LE(stats.shaded_point_count, stats.drawn_point_count);
  EXPECT_GE(stats.drawn_block_count, 1u);
  EXPECT_GT(stats.refined_pixel_count, 1000);
  EXPECT_GT(stats.total_ms, 0);
  EXPECT_GE(stats.total_ms * 1.01f, stats.project_ms + stats.shade_ms + stats.refine_ms + stats.resample_ms);
  const void* pixels = nullptr;
  size_t stride = 0;
  for (const int wrong : {0, 4}) {
    EXPECT_EQ(maq_image_get_plane(image.get(), maq_image_plane(wrong), &pixels, &stride), MAQ_ERROR_INVALID_ARGUMENT);
  }
}

TEST_F(ApiSceneRendering, SavedImagesAreThePlanes) {
  const maq_pinhole_camera camera = camera_at(0.3, 100, 80);
  maquette::SceneRenderer renderer(context_, api_tiny_scene::renderer_config(), scene_);
  const maquette::Image image = renderer.run(camera);
  const TempFolder folder;
  image.save(folder.file("plain.png"));
  image.save(folder.file("alpha.png"), MAQ_IMAGE_ALPHA_ON);
  image.save(folder.file("photo.jpg"));
  maquette::Source source(context_, "image:" + folder.file("plain.png"));
  const maq_frame_desc desc = source.next()->desc();
  EXPECT_EQ(desc.width_px, 100);
  EXPECT_EQ(desc.height_px, 80);
  const std::string alpha = read_text(folder.file("alpha.png"));
  EXPECT_EQ(alpha[25], 6) << "PNG's colour type with alpha";
  EXPECT_EQ(read_text(folder.file("plain.png"))[25], 2);
  EXPECT_EQ(maq_image_save(image.get(), folder.file("alpha.jpg").c_str(), MAQ_IMAGE_ALPHA_ON),
            MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_image_save(image.get(), "/no/such/folder/a.png", MAQ_IMAGE_ALPHA_OFF), MAQ_ERROR_UNWRITABLE);
  // As from C, where an enum parameter takes any number.
  const auto save_from_c = reinterpret_cast<maq_status (*)(const maq_image*, const char*, int32_t)>(
      reinterpret_cast<void (*)()>(maq_image_save));
  EXPECT_EQ(save_from_c(image.get(), "f.png", 2), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiSceneRendering, ImagesAreBoundedReusedAndOutliveEverything) {
  std::vector<maquette::Image> held;
  const maq_pinhole_camera camera = camera_at(0);
  std::vector<uint8_t> expected;
  {
    const maquette::Context context;
    maq_scene_renderer_config config = renderer_config();
    config.image_pool_size = 2;
    std::optional<maquette::Scene> scene = api_tiny_scene::ball_scene(context);
    maquette::SceneRenderer renderer(context, config, *scene);
    scene.reset();
    for (int i = 0; i < 2; ++i) held.push_back(renderer.run(camera));
    maq_image* image = nullptr;
    EXPECT_EQ(maq_scene_renderer_run(renderer.get(), &camera, &image), MAQ_ERROR_POOL_EMPTY);
    EXPECT_EQ(image, nullptr);
    held.pop_back();
    held.push_back(renderer.run(camera));
    expected = bgr_of(held[0], camera);
  }
  EXPECT_EQ(bgr_of(held[1], camera), expected);
}

TEST_F(ApiSceneRendering, WhereNothingIsSeenThereIsTheBackgroundAndNoNetworkRuns) {
  maq_scene_renderer_config config = renderer_config();
  config.background[0] = 200;
  config.background[1] = 100;
  config.background[2] = 50;
  config.use_background = 1;
  maquette::SceneRenderer renderer(context_, config, scene_);
  maq_pinhole_camera camera = camera_at(0);
  camera.centre[0] = -3;
  const maquette::Image image = renderer.run(camera);
  const std::vector<uint8_t> bgr = bgr_of(image, camera);
  for (size_t i = 0; i < bgr.size(); i += 3) {
    ASSERT_TRUE(bgr[i] == 50 && bgr[i + 1] == 100 && bgr[i + 2] == 200) << i;
  }
  for (const float depth : plane_of<float>(image, MAQ_IMAGE_PLANE_DEPTH, camera)) ASSERT_EQ(depth, 0);
  EXPECT_EQ(image.scene_stats().refined_pixel_count, 0);
  EXPECT_EQ(image.scene_stats().shaded_point_count, 0u);
}

TEST_F(ApiSceneRendering, OverTheBackgroundItIsMixedByAlpha) {
  const maq_pinhole_camera camera = camera_at(0);
  std::array<std::vector<uint8_t>, 2> pictures;
  std::vector<uint8_t> alpha;
  for (const uint8_t over : {uint8_t(0), uint8_t(1)}) {
    maq_scene_renderer_config config = renderer_config();
    config.background[1] = 255;
    config.use_background = over;
    maquette::SceneRenderer renderer(context_, config, scene_);
    const maquette::Image image = renderer.run(camera);
    pictures[over] = bgr_of(image, camera);
    alpha = plane_of<uint8_t>(image, MAQ_IMAGE_PLANE_ALPHA, camera);
  }
  size_t between = 0;
  for (size_t i = 0; i < alpha.size(); ++i) {
    for (size_t channel = 0; channel < 3; ++channel) {
      const double behind = channel == 1 ? 255 : 0, share = alpha[i] / 255.0;
      ASSERT_NEAR(pictures[1][3 * i + channel], share * pictures[0][3 * i + channel] + (1 - share) * behind, 2) << i;
    }
    between += alpha[i] > 0 && alpha[i] < 255;
  }
  EXPECT_GT(between, 20u);
}

TEST_F(ApiSceneRendering, PicturesHaveAnySizeUpToTheLimit) {
  maquette::SceneRenderer renderer(context_, renderer_config(), scene_);
  const std::pair<int, int> sizes[] = {{1, 1}, {333, 17}, {16, 300}, {64, 48}};
  for (const auto& [width, height] : sizes) {
    const maq_pinhole_camera camera = camera_at(0, width, height);
    EXPECT_EQ(bgr_of(renderer.run(camera), camera).size(), size_t(3 * width * height));
  }
  const std::pair<int, int> wrong[] = {{0, 10}, {10, -1}, {20000, 10}, {16000, 16000}, {INT32_MAX, INT32_MAX}};
  for (const auto& [width, height] : wrong) {
    const maq_pinhole_camera camera = camera_at(0, width, height);
    maq_image* image = nullptr;
    EXPECT_EQ(maq_scene_renderer_run(renderer.get(), &camera, &image), MAQ_ERROR_IMAGE_SIZE) << width;
    EXPECT_EQ(image, nullptr);
  }
}

TEST_F(ApiSceneRendering, CamerasThatAreNoneAreRefusedAndCostNoImage) {
  maq_scene_renderer_config config = renderer_config();
  config.image_pool_size = 1;
  maquette::SceneRenderer renderer(context_, config, scene_);
  const auto expect = [&](const std::string& text, auto change) {
    maq_pinhole_camera camera = camera_at(0);
    change(camera);
    maq_image* image = nullptr;
    EXPECT_EQ(maq_scene_renderer_run(renderer.get(), &camera, &image), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_NE(std::string(maq_last_error(renderer.get())).find(text), std::string::npos)
        << maq_last_error(renderer.get());
    EXPECT_EQ(image, nullptr);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect("rendered without distortion", [](auto& camera) { camera.intrinsics.distortion[3] = 1e-9; });
  expect("rendered without distortion", [=](auto& camera) { camera.intrinsics.distortion[0] = nan; });
  expect("focal lengths", [](auto& camera) { camera.intrinsics.fy_px = -1; });
  expect("differ by a factor", [](auto& camera) { camera.intrinsics.fy_px = camera.intrinsics.fx_px * 2000; });
  expect("principal point", [](auto& camera) { camera.intrinsics.cx_px = 1e7; });
  expect("not finite", [=](auto& camera) { camera.rotation[4] = nan; });
  expect("rotation", [](auto& camera) { camera.rotation[5] = 0; });
  expect("camera.struct_size", [](auto& camera) { camera.struct_size += 8; });
  EXPECT_GT(renderer.run(camera_at(0)).scene_stats().shaded_point_count, 0u);
}

TEST_F(ApiSceneRendering, PointsNearerThanTheNearDepthAreNotDrawn) {
  maq_scene_renderer_config config = renderer_config();
  config.near_depth = 2.5;
  maquette::SceneRenderer renderer(context_, config, scene_);
  const maq_pinhole_camera camera = camera_at(0);
  for (const float depth : plane_of<float>(renderer.run(camera), MAQ_IMAGE_PLANE_DEPTH, camera)) {
    ASSERT_TRUE(depth == 0 || depth >= 2.49f) << depth;
  }
}

TEST_F(ApiSceneRendering, SeveralRenderersOfOneSceneRunAtOnce) {
  const maq_pinhole_camera camera = camera_at(1);
  maquette::SceneRenderer first(context_, renderer_config(), scene_);
  const std::vector<uint8_t> expected = bgr_of(first.run(camera), camera);
  std::vector<std::thread> threads;
  for (int t = 0; t < 2; ++t) {
    threads.emplace_back([&] {
      maq_scene_renderer_config config = renderer_config();
      config.model.threads = 2;
      maquette::SceneRenderer renderer(context_, config, scene_);
      for (int i = 0; i < 3; ++i) EXPECT_EQ(bgr_of(renderer.run(camera), camera), expected);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(ApiSceneRendering, OtherNetworksThanTheScenesAreRefused) {
  maq_scene_renderer_config config = renderer_config();
  config.model.bundle_path = "/no/such/bundle";
  expect_refused(config, MAQ_ERROR_NOT_FOUND, "/no/such/bundle");
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_bundle";
  expect_refused(config, MAQ_ERROR_UNSUPPORTED, "the task scenes");
  const TempFolder folder;
  std::filesystem::copy(api_tiny_scene::kBundle, folder.file("bundle"));
  const std::string bundle = folder.file("bundle"), basis = bundle + "/basis.bin";
  std::string numbers = read_text(basis);
  numbers[0] = char(numbers[0] ^ 1);
  write_text(basis, numbers);
  config.model.bundle_path = bundle.c_str();
  expect_refused(config, MAQ_ERROR_BAD_BUNDLE, "basis.bin has SHA-256");
  // Sound, but not those of the scene.
  ASSERT_EQ(std::system(("sha256sum '" + basis + "' > '" + folder.file("sum") + "'").c_str()), 0);
  nlohmann::json manifest = nlohmann::json::parse(read_text(bundle + "/manifest.json"));
  manifest["files"]["basis.bin"]["sha256"] = read_text(folder.file("sum")).substr(0, 64);
  write_text(bundle + "/manifest.json", manifest.dump());
  expect_refused(config, MAQ_ERROR_BAD_BUNDLE, "Other networks than those");
}

}  // namespace
