// The C API for scenes returns a status and a sentence for NULL and for structs of unknown size. It never crashes.
#include <gtest/gtest.h>

#include "support/samples/api_tiny_scene.h"

namespace {

using api_tiny_scene::kCapture;

class ApiSceneArguments : public ::testing::Test {
 protected:
  // On `handle` (NULL: of this thread) there is a sentence with `text`.
  static void expect_invalid(maq_status actual, const void* handle, const std::string& text) {
    EXPECT_EQ(actual, MAQ_ERROR_INVALID_ARGUMENT) << text;
    EXPECT_NE(std::string(maq_last_error(handle)).find(text), std::string::npos)
        << text << ": " << maq_last_error(handle);
  }

  maquette::Context context_;
  maquette::Capture capture_{context_, kCapture};
  maquette::Scene scene_ = api_tiny_scene::ball_scene(context_);
  std::vector<float> places_ = api_tiny_scene::ball(100);
  maq_point_cloud cloud_ = api_tiny_scene::cloud_of(places_);
  maq_pinhole_camera camera_ = api_tiny_scene::camera_at(0);
  maq_scene_build_config building_ = api_tiny_scene::build_config();
  maq_scene_renderer_config rendering_ = api_tiny_scene::renderer_config();
};

TEST_F(ApiSceneArguments, NullHandlesAreRefusedByName) {
  maq_capture* capture = nullptr;
  maq_capture_info capture_info{};
  maq_capture_view view{};
  maq_frame* frame = nullptr;
  maq_scene* scene = nullptr;
  maq_scene_builder* builder = nullptr;
  maq_scene_build_stats build_stats{};
  maq_scene_info info{};
  maq_scene_renderer* renderer = nullptr;
  maq_image* image = nullptr;
  maq_scene_render_stats image_stats{};
  maq_capture_drop drop{};
  uint64_t count = 0;
  const void* pixels = nullptr;
  size_t stride = 0;
  expect_invalid(maq_capture_open(nullptr, "f", &capture), nullptr, "maq_capture_open: context is NULL");
  expect_invalid(maq_capture_get_info(nullptr, &capture_info), nullptr, "maq_capture_get_info: capture is NULL");
  expect_invalid(maq_capture_get_view(nullptr, 0, &view), nullptr, "maq_capture_get_view: capture is NULL");
  expect_invalid(maq_capture_get_drop(nullptr, 0, &drop), nullptr, "maq_capture_get_drop: capture");
  expect_invalid(maq_capture_load_view(nullptr, 0, &frame), nullptr, "maq_capture_load_view: capture is NULL");
  expect_invalid(maq_scene_build(nullptr, &building_, capture_.get(), &scene), nullptr,
                 "maq_scene_build: context is NULL");
  expect_invalid(maq_scene_builder_create(nullptr, &building_, &cloud_, &builder), nullptr,
                 "maq_scene_builder_create: context is NULL");
  expect_invalid(maq_scene_builder_add_view(nullptr, nullptr, &camera_, &count), nullptr,
                 "maq_scene_builder_add_view: builder is NULL");
  expect_invalid(maq_scene_builder_cancel(nullptr), nullptr, "maq_scene_builder_cancel: builder is NULL");
  expect_invalid(maq_scene_builder_get_stats(nullptr, &build_stats), nullptr,
                 "maq_scene_builder_get_stats: builder is NULL");
  expect_invalid(maq_scene_builder_finish(nullptr, &scene), nullptr, "maq_scene_builder_finish: builder is NULL");
  expect_invalid(maq_scene_open(nullptr, "f", &scene), nullptr, "maq_scene_open: context is NULL");
  expect_invalid(maq_scene_save(nullptr, "f"), nullptr, "maq_scene_save: scene is NULL");
  expect_invalid(maq_scene_save_ply(nullptr, "f"), nullptr, "maq_scene_save_ply: scene is NULL");
  expect_invalid(maq_scene_get_info(nullptr, &info), nullptr, "maq_scene_get_info: scene is NULL");
  expect_invalid(maq_scene_renderer_create(nullptr, &rendering_, scene_.get(), &renderer), nullptr,
                 "maq_scene_renderer_create: context is NULL");
  expect_invalid(maq_scene_renderer_run(nullptr, &camera_, &image), nullptr,
                 "maq_scene_renderer_run: renderer is NULL");
  expect_invalid(maq_image_get_plane(nullptr, MAQ_IMAGE_PLANE_BGR, &pixels, &stride), nullptr,
                 "maq_image_get_plane: image is NULL");
  expect_invalid(maq_image_get_scene_stats(nullptr, &image_stats), nullptr, "maq_image_get_scene_stats: image is NULL");
  EXPECT_TRUE(capture == nullptr && scene == nullptr && builder == nullptr && renderer == nullptr && image == nullptr);
}

TEST_F(ApiSceneArguments, NullArgumentsAreRefusedByNameWithTheHandle) {
  maq_scene* scene = nullptr;
  maq_scene_builder* none = nullptr;
  maq_scene_renderer* no_renderer = nullptr;
  maq_image* image = nullptr;
  uint64_t count = 0;
  const void* pixels = nullptr;
  size_t stride = 0;
  maq_context* const context = context_.get();
  maq_capture* const capture = capture_.get();
  expect_invalid(maq_capture_open(context, nullptr, nullptr), context, "folder is NULL");
  expect_invalid(maq_capture_open(context, "f", nullptr), context, "capture is NULL");
  expect_invalid(maq_capture_get_info(capture, nullptr), capture, "info is NULL");
  expect_invalid(maq_capture_get_view(capture, 0, nullptr), capture, "view is NULL");
  expect_invalid(maq_capture_get_drop(capture, 0, nullptr), capture, "index is 0, but there are 0");
  expect_invalid(maq_capture_load_view(capture, 0, nullptr), capture, "frame is NULL");
  expect_invalid(maq_scene_build(context, &building_, nullptr, &scene), context, "capture is NULL");
  expect_invalid(maq_scene_build(context, &building_, capture, nullptr), context, "scene is NULL");
  expect_invalid(maq_scene_builder_create(context, &building_, nullptr, &none), context, "cloud is NULL");
  expect_invalid(maq_scene_builder_create(context, &building_, &cloud_, nullptr), context, "builder is NULL");
  expect_invalid(maq_scene_open(context, nullptr, &scene), context, "path is NULL");
  expect_invalid(maq_scene_open(context, "f", nullptr), context, "scene is NULL");
  expect_invalid(maq_scene_open_memory(context, nullptr, 1, &scene), context, "data is NULL");
  expect_invalid(maq_scene_save(scene_.get(), nullptr), scene_.get(), "path is NULL");
  expect_invalid(maq_scene_save_ply(scene_.get(), nullptr), scene_.get(), "path is NULL");
  expect_invalid(maq_scene_get_info(scene_.get(), nullptr), scene_.get(), "info is NULL");
  expect_invalid(maq_scene_renderer_create(context, &rendering_, nullptr, &no_renderer), context, "scene is NULL");
  expect_invalid(maq_scene_renderer_create(context, &rendering_, scene_.get(), nullptr), context, "renderer is NULL");

  maquette::SceneBuilder builder(context_, building_, cloud_);
  const maquette::Frame photo = capture_.load_view(0);
  expect_invalid(maq_scene_builder_add_view(builder.get(), nullptr, &camera_, &count), builder.get(), "photo is NULL");
  expect_invalid(maq_scene_builder_add_view(builder.get(), photo.get(), nullptr, &count), builder.get(),
                 "camera is NULL");
  expect_invalid(maq_scene_builder_get_stats(builder.get(), nullptr), builder.get(), "stats is NULL");
  expect_invalid(maq_scene_builder_finish(builder.get(), nullptr), builder.get(), "scene is NULL");
  maquette::SceneRenderer renderer(context_, rendering_, scene_);
  expect_invalid(maq_scene_renderer_run(renderer.get(), nullptr, &image), renderer.get(), "camera is NULL");
  expect_invalid(maq_scene_renderer_run(renderer.get(), &camera_, nullptr), renderer.get(), "image is NULL");
  const maquette::Image rendered = renderer.run(camera_);
  expect_invalid(maq_image_get_plane(rendered.get(), MAQ_IMAGE_PLANE_BGR, nullptr, &stride), rendered.get(),
                 "pixels is NULL");
  expect_invalid(maq_image_get_plane(rendered.get(), MAQ_IMAGE_PLANE_BGR, &pixels, nullptr), rendered.get(),
                 "stride_bytes is NULL");
  expect_invalid(maq_image_get_scene_stats(rendered.get(), nullptr), rendered.get(), "stats is NULL");
  // As from C, where an enum parameter takes any number.
  const auto save_from_c = reinterpret_cast<maq_status (*)(const maq_image*, const char*, int32_t)>(
      reinterpret_cast<void (*)()>(maq_image_save));
  expect_invalid(maq_image_save(rendered.get(), nullptr, MAQ_IMAGE_ALPHA_OFF), rendered.get(), "path is NULL");
  expect_invalid(save_from_c(rendered.get(), "f.png", 2), rendered.get(), "alpha is 2");
}

TEST_F(ApiSceneArguments, StructsOfUnknownSizeAreRefusedByName) {
  maquette::SceneBuilder builder(context_, building_, cloud_);
  maquette::SceneRenderer renderer(context_, rendering_, scene_);
  const maquette::Image image = renderer.run(camera_);
  const maquette::Frame photo = capture_.load_view(0);
  for (const uint32_t wrong : {0u, 4u, 100000u, 0xFFFFFFFFu}) {
    const std::string is = ".struct_size is " + std::to_string(wrong);
    maq_capture_info capture_info{};
    capture_info.struct_size = wrong;
    expect_invalid(maq_capture_get_info(capture_.get(), &capture_info), capture_.get(), "info" + is);
    maq_capture_view view{};
    view.struct_size = wrong;
    expect_invalid(maq_capture_get_view(capture_.get(), 0, &view), capture_.get(), "view" + is);
    EXPECT_EQ(view.name, nullptr) << "nothing is written";
    maq_scene_build_config building = building_;
    building.struct_size = wrong;
    maq_scene* scene = nullptr;
    maq_scene_builder* none = nullptr;
    expect_invalid(maq_scene_build(context_.get(), &building, capture_.get(), &scene), context_.get(), "config" + is);
    expect_invalid(maq_scene_builder_create(context_.get(), &building, &cloud_, &none), context_.get(), "config" + is);
    maq_scene_build_stats build_stats{};
    build_stats.struct_size = wrong;
    expect_invalid(maq_scene_get_build_stats(scene_.get(), &build_stats), scene_.get(), "stats" + is);
    expect_invalid(maq_scene_builder_get_stats(builder.get(), &build_stats), builder.get(), "stats" + is);
    maq_point_cloud cloud = cloud_;
    cloud.struct_size = wrong;
    expect_invalid(maq_scene_builder_create(context_.get(), &building_, &cloud, &none), context_.get(), "cloud" + is);
    maq_pinhole_camera camera = camera_;
    camera.struct_size = wrong;
    maq_image* no_image = nullptr;
    expect_invalid(maq_scene_builder_add_view(builder.get(), photo.get(), &camera, nullptr), builder.get(),
                   "camera" + is);
    expect_invalid(maq_scene_renderer_run(renderer.get(), &camera, &no_image), renderer.get(), "camera" + is);
    maq_scene_info info{};
    info.struct_size = wrong;
    expect_invalid(maq_scene_get_info(scene_.get(), &info), scene_.get(), "info" + is);
    maq_scene_renderer_config rendering = rendering_;
    rendering.struct_size = wrong;
    maq_scene_renderer* no_renderer = nullptr;
    expect_invalid(maq_scene_renderer_create(context_.get(), &rendering, scene_.get(), &no_renderer), context_.get(),
                   "config" + is);
    maq_scene_render_stats image_stats{};
    image_stats.struct_size = wrong;
    expect_invalid(maq_image_get_scene_stats(image.get(), &image_stats), image.get(), "stats" + is);
    EXPECT_TRUE(scene == nullptr && none == nullptr && no_renderer == nullptr && no_image == nullptr);
    EXPECT_EQ(maq_scene_build_config_init(&building, wrong), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(maq_scene_renderer_config_init(&rendering, wrong), MAQ_ERROR_INVALID_ARGUMENT);
  }
  EXPECT_EQ(maq_scene_build_config_init(nullptr, sizeof(maq_scene_build_config)), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_scene_renderer_config_init(nullptr, sizeof(maq_scene_renderer_config)), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiSceneArguments, DefaultsAreThoseOfTheHeader) {
  const maq_scene_build_config building = maquette::default_scene_build_config();
  EXPECT_EQ(building.struct_size, sizeof building);
  EXPECT_TRUE(building.model.bundle_path == nullptr && building.progress_callback == nullptr);
  const maq_scene_renderer_config rendering = maquette::default_scene_renderer_config();
  EXPECT_EQ(rendering.struct_size, sizeof rendering);
  EXPECT_TRUE(rendering.model.bundle_path == nullptr && rendering.image_pool_size == 0);
}

TEST_F(ApiSceneArguments, WithoutAConfigTheInstalledBundleIsUsed) {
  maq_scene_builder* builder = nullptr;
  ASSERT_EQ(maq_scene_builder_create(context_.get(), nullptr, &cloud_, &builder), MAQ_OK) << maq_last_error(nullptr);
  maq_scene_builder_destroy(builder);
}

TEST_F(ApiSceneArguments, DestroyingNullIsFine) {
  maq_capture_destroy(nullptr);
  maq_scene_destroy(nullptr);
  maq_scene_builder_destroy(nullptr);
  maq_scene_renderer_destroy(nullptr);
  maq_image_release(nullptr);
}

TEST_F(ApiSceneArguments, FoldersAndPathsThatAreEmptyAreAStatus) {
  maq_capture* capture = nullptr;
  EXPECT_EQ(maq_capture_open(context_.get(), "", &capture), MAQ_ERROR_NOT_FOUND);
  maq_scene* scene = nullptr;
  EXPECT_EQ(maq_scene_open(context_.get(), "", &scene), MAQ_ERROR_NOT_FOUND);
  building_.model.bundle_path = "";
  EXPECT_EQ(maq_scene_build(context_.get(), &building_, capture_.get(), &scene), MAQ_ERROR_NOT_FOUND);
}

// Layouts that apps rely on.
static_assert(sizeof(void*) != 8 ||
                  (sizeof(maq_pinhole_camera) == 208 && offsetof(maq_pinhole_camera, rotation) == 112),
              "");

}  // namespace
