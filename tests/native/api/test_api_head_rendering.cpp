// Images of heads through the C API: planes, files, cameras of photos, the pool, what is refused; previews of a fit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <maquette/maquette.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "support/temp_folder.h"

namespace api_head_rendering_tests {
namespace {

constexpr char kRoundHeads[] = MAQ_TEST_DATA "/round_heads/bundle";

class ApiHeadRendering : public testing::Test {
 protected:
  ApiHeadRendering() {
    builder.add_photo(photo(), known());
    head = builder.fit(0);
  }

  static maq_head_builder_config without_texture() {
    maq_head_builder_config config = maquette::default_head_builder_config();
    config.model.bundle_path = kRoundHeads;
    config.texture = MAQ_HEAD_TEXTURE_OFF;
    return config;
  }
  static maq_head_photo known() {
    maq_head_photo hints = maquette::default_head_photo();
    const float box[4] = {110, 60, 200, 180};
    std::copy(box, box + 4, hints.box_px);
    return hints;
  }
  maquette::Frame photo() {
    for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = uint8_t(120 + 10 * (i % 3));
    maq_frame_desc desc;
    maq_frame_desc_init(&desc, sizeof desc);
    desc.format = MAQ_PIXEL_BGR8, desc.width_px = 320, desc.height_px = 240;
    desc.planes[0] = pixels.data();
    return maquette::Frame(context, desc);
  }
  static maq_head_mesh_config coarse_mesh() {
    maq_head_mesh_config options = maquette::default_head_mesh_config();
    options.cell_m = 0.006;
    return options;
  }
  maquette::HeadMesh mesh() const { return maquette::HeadMesh(head, coarse_mesh()); }
  static maq_head_renderer_config coarse() {
    maq_head_renderer_config config = maquette::default_head_renderer_config();
    config.threads = 2;
    return config;
  }
  template <class T>
  static const T* plane(const maquette::Image& image, maq_image_plane which, size_t channels, int width) {
    size_t stride = 0;
    const void* pixels = image.plane(which, &stride);
    EXPECT_EQ(stride, channels * sizeof(T) * size_t(width));
    return static_cast<const T*>(pixels);
  }
  static void expect_text(const char* text) {
    EXPECT_NE(std::strstr(maq_last_error(nullptr), text), nullptr) << maq_last_error(nullptr);
  }

  std::vector<uint8_t> pixels = std::vector<uint8_t>(320 * 240 * 3);
  const maquette::Context context;
  maquette::HeadBuilder builder{context, without_texture()};
  maquette::Head head{nullptr};
};

TEST_F(ApiHeadRendering, GivesPlanesOfTheHeadFromTheFront) {
  maquette::HeadRenderer renderer(context, coarse(), mesh());
  const maq_pinhole_camera camera = renderer.camera(0, 0, 160, 120);
  const maquette::Image image = renderer.run(camera);
  const size_t middle = 60 * 160 + 80;
  const auto* alpha = plane<uint8_t>(image, MAQ_IMAGE_PLANE_ALPHA, 1, 160);
  const auto* bgr = plane<uint8_t>(image, MAQ_IMAGE_PLANE_BGR, 3, 160);
  const auto* depth = plane<float>(image, MAQ_IMAGE_PLANE_DEPTH, 1, 160);
  const auto* normals = plane<float>(image, MAQ_IMAGE_PLANE_NORMALS, 3, 160);
  const auto* points = plane<float>(image, MAQ_IMAGE_PLANE_TEMPLATE_POINTS, 3, 160);
  EXPECT_EQ(alpha[0], 0);
  EXPECT_EQ(bgr[0], 0);
  EXPECT_EQ(depth[0], 0);
  EXPECT_EQ(alpha[middle], 255);
  EXPECT_GT(bgr[3 * middle + 2], 60);
  EXPECT_LT(normals[3 * middle + 2], -0.8f) << "towards the camera";
  const maq_head_landmark nose = head.landmark("nose_tip");
  EXPECT_NEAR(depth[middle], camera.centre[2] - nose.point_m[2], 0.03);
  EXPECT_GT(points[3 * middle + 2], 0.05f) << "the front of the template head";
}

TEST_F(ApiHeadRendering, ATextureIsShownInPlaceOfTheNetworksColours) {
  // Stripes in the photo: the texture has them, the network's colours do not.
  std::vector<uint8_t> striped(320 * 240 * 3);
  for (size_t i = 0; i < striped.size(); ++i) striped[i] = i / 3 % 16 < 8 ? 40 : 220;
  maq_frame_desc desc;
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_BGR8, desc.width_px = 320, desc.height_px = 240;
  desc.planes[0] = striped.data();
  maq_head_builder_config config = maquette::default_head_builder_config();
  config.model.bundle_path = kRoundHeads;
  config.texture_px = 512;
  maquette::HeadBuilder textured(context, config);
  textured.add_photo(maquette::Frame(context, desc), known());
  maquette::Head painted = textured.fit(0);
  maq_head_renderer_config bare = coarse();
  bare.shading_strength = MAQ_HEAD_SHADING_STRENGTH_OFF;
  maquette::HeadRenderer renderer(context, bare, maquette::HeadMesh(painted, coarse_mesh()));
  const maq_pinhole_camera camera = painted.camera(0);
  const auto contrast = [&](const maquette::Image& image) {
    const auto* bgr = plane<uint8_t>(image, MAQ_IMAGE_PLANE_BGR, 3, 320);
    double low = 255, high = 0;
    for (int column = 135; column < 175; ++column) {  // the middle of the face
      const double value = bgr[3 * (120 * 320 + column)];
      low = std::min(low, value), high = std::max(high, value);
    }
    return high - low;
  };
  EXPECT_GT(contrast(renderer.run(camera)), 120);
  renderer.set_shading(MAQ_HEAD_SHADING_SHAPE);
  EXPECT_LT(contrast(renderer.run(camera)), 40);
  // The animatable head has the same photo in texture coordinates of its own.
  maquette::HeadRenderer animatable(context, bare, maquette::HeadMesh(painted));
  EXPECT_GT(contrast(animatable.run(camera)), 120);
}

TEST_F(ApiHeadRendering, TheCameraOfAPhotoLaysTheHeadOnThePhoto) {
  const maq_pinhole_camera camera = head.camera(0);
  EXPECT_EQ(camera.intrinsics.width_px, 320);
  EXPECT_EQ(camera.intrinsics.fx_px, camera.intrinsics.fy_px);
  EXPECT_NEAR(camera.intrinsics.fx_px, builder.photo(0).focal_px, 0.01);
  maquette::HeadRenderer renderer(context, coarse(), mesh());
  const maquette::Image image = renderer.run(camera);
  const auto* alpha = plane<uint8_t>(image, MAQ_IMAGE_PLANE_ALPHA, 1, 320);
  // The encoder sees an ellipse of that share of the crop, in the middle of the box; the neck is cut off.
  double area = 0, x = 0;
  for (int i = 0; i < 320 * 240; ++i) area += alpha[i] / 255.0, x += alpha[i] / 255.0 * (i % 320);
  const double crop_px = 1.6 * 120;
  EXPECT_NEAR(area / (crop_px * crop_px), builder.photo(0).head_coverage, 0.06);
  EXPECT_NEAR(x / area, 154.5, 4);
  maq_pinhole_camera none{};
  none.struct_size = sizeof none;
  EXPECT_EQ(maq_head_get_camera(head.get(), 1, &none), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiHeadRendering, ShadingsDifferAndAreSwitched) {
  maquette::HeadRenderer renderer(context, coarse(), mesh());
  const maq_pinhole_camera camera = renderer.camera(0.4, 0.1, 80, 60);
  std::vector<std::vector<uint8_t>> seen;
  for (const maq_head_shading shading : {MAQ_HEAD_SHADING_COLOUR, MAQ_HEAD_SHADING_SHAPE, MAQ_HEAD_SHADING_NORMALS,
                                         MAQ_HEAD_SHADING_TEMPLATE, MAQ_HEAD_SHADING_DEPTH}) {
    renderer.set_shading(shading);
    const maquette::Image image = renderer.run(camera);
    const auto* bgr = plane<uint8_t>(image, MAQ_IMAGE_PLANE_BGR, 3, 80);
    seen.emplace_back(bgr, bgr + size_t(80 * 60 * 3));
    EXPECT_EQ(std::count(seen.begin(), seen.end(), seen.back()), 1) << int(shading);
  }
  for (const int wrong : {-1, 5}) {
    EXPECT_EQ(maq_head_renderer_set_shading(renderer.get(), maq_head_shading(wrong)), MAQ_ERROR_INVALID_ARGUMENT);
    expect_text("shading is ");
  }
}

TEST_F(ApiHeadRendering, ImagesAreSavedWithAndWithoutAlpha) {
  const TempFolder folder;
  maquette::HeadRenderer renderer(context, coarse(), mesh());
  const maquette::Image image = renderer.run(renderer.camera(0, 0, 64, 48));
  image.save(folder.file("a.png"), MAQ_IMAGE_ALPHA_ON);
  image.save(folder.file("b.png"));
  image.save(folder.file("c.jpg"));
  EXPECT_EQ(read_text(folder.file("a.png"))[25], 6) << "PNG's colour type with alpha";
  EXPECT_EQ(read_text(folder.file("b.png"))[25], 2);
  EXPECT_EQ(maq_image_save(image.get(), folder.file("d.jpg").c_str(), MAQ_IMAGE_ALPHA_ON), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_image_save(image.get(), "/nowhere/a.png", MAQ_IMAGE_ALPHA_OFF), MAQ_ERROR_UNWRITABLE);
  EXPECT_EQ(maq_image_save(image.get(), nullptr, MAQ_IMAGE_ALPHA_OFF), MAQ_ERROR_INVALID_ARGUMENT);
}

TEST_F(ApiHeadRendering, ImagesAreBoundedAndOutliveTheRendererAndItsHead) {
  std::vector<maquette::Image> held;
  {
    maq_head_renderer_config config = coarse();
    config.image_pool_size = 2;
    maquette::HeadRenderer renderer(context, config, mesh());
    head = maquette::Head(nullptr);
    const maq_pinhole_camera camera = renderer.camera(0, 0, 64, 48);
    for (int i = 0; i < 2; ++i) held.push_back(renderer.run(camera));
    maq_image* image = nullptr;
    EXPECT_EQ(maq_head_renderer_run(renderer.get(), &camera, &image), MAQ_ERROR_POOL_EMPTY);
    held.pop_back();
    held.push_back(renderer.run(camera));
  }
  EXPECT_EQ(plane<uint8_t>(held[1], MAQ_IMAGE_PLANE_ALPHA, 1, 64)[24 * 64 + 32], 255);
}

TEST_F(ApiHeadRendering, WrongCamerasAreASentence) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  maquette::HeadRenderer renderer(context, coarse(), mesh());
  const auto answer = [&](auto&& change) {
    maq_pinhole_camera camera = renderer.camera(0, 0, 64, 48);
    change(camera);
    maq_image* image = nullptr;
    const maq_status status = maq_head_renderer_run(renderer.get(), &camera, &image);
    EXPECT_EQ(status == MAQ_OK, image != nullptr);
    maq_image_release(image);
    return status;
  };
  using Camera = maq_pinhole_camera;
  EXPECT_EQ(answer([](Camera& c) { c.struct_size = 8; }), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(answer([](Camera& c) { c.intrinsics.distortion[0] = 0.1; }), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(answer([&](Camera& c) { c.centre[2] = nan; }), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(answer([](Camera& c) { c.intrinsics.fx_px = -1; }), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(answer([](Camera& c) { c.intrinsics.width_px = c.intrinsics.height_px = 0; }), MAQ_ERROR_IMAGE_SIZE);
  EXPECT_EQ(answer([](Camera& c) { c.intrinsics.width_px = c.intrinsics.height_px = 20000; }), MAQ_ERROR_IMAGE_SIZE);
  EXPECT_EQ(answer([](Camera& c) { c.centre[2] = -c.centre[2]; }), MAQ_OK) << "the head is behind it";
  EXPECT_EQ(answer([](Camera& c) { c.intrinsics.fx_px = c.intrinsics.fy_px = 1e-30; }), MAQ_OK);

  const maquette::Image image = renderer.run(renderer.camera(0, 0, 64, 48));
  const void* plane = nullptr;
  size_t stride = 0;
  for (const int wrong : {0, 6}) {
    EXPECT_EQ(maq_image_get_plane(image.get(), maq_image_plane(wrong), &plane, &stride), MAQ_ERROR_INVALID_ARGUMENT);
  }
#if MAQ_HAS_SCENES
  maq_scene_render_stats stats{};
  stats.struct_size = sizeof stats;
  EXPECT_EQ(maq_image_get_scene_stats(image.get(), &stats), MAQ_ERROR_INVALID_ARGUMENT);
  expect_text("image is of a head");
#endif
  maq_pinhole_camera camera{};
  camera.struct_size = sizeof camera;
  EXPECT_EQ(maq_head_renderer_get_camera(renderer.get(), nan, 0, 64, 48, &camera), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_head_renderer_get_camera(renderer.get(), 0, 0, 64, -1, &camera), MAQ_ERROR_IMAGE_SIZE);
}

TEST_F(ApiHeadRendering, TwoRenderersRunInTwoThreads) {
  const auto turn = [&](maquette::HeadRenderer& renderer) {
    std::vector<uint8_t> seen;
    for (int i = 0; i < 8; ++i) {
      const maquette::Image image = renderer.run(renderer.camera(0.5 * i, 0, 90, 70));
      const auto* bgr = plane<uint8_t>(image, MAQ_IMAGE_PLANE_BGR, 3, 90);
      seen.insert(seen.end(), bgr, bgr + size_t(90 * 70 * 3));
    }
    return seen;
  };
  maquette::HeadRenderer one(context, coarse(), mesh()), two(context, coarse(), mesh());
  std::vector<uint8_t> by_one, by_two;
  std::thread other([&] { by_two = turn(two); });
  by_one = turn(one);
  other.join();
  EXPECT_EQ(by_one, by_two);
}

TEST_F(ApiHeadRendering, PreviewsOfAFitAreHeadsThatOutliveIt) {
  std::vector<maquette::Head> previews;
  builder.set_preview(0, [&](maquette::Head preview) { previews.push_back(std::move(preview)); });
  maquette::HeadBuilder moved = std::move(builder);
  head = moved.fit(20);
  const int steps = moved.stats().step_count;
  ASSERT_GT(steps, 0);
  EXPECT_GE(int(previews.size()), steps) << "one before each step";
  EXPECT_EQ(previews.front().info().photo_count, 1u);
  EXPECT_EQ(previews.front().landmark_names(), head.landmark_names());
  // The first is what the network saw, the last what is nearly done: its colours have come from the photo.
  const auto red = [](const maquette::Head& of) {
    const maquette::HeadMesh made(of, coarse_mesh());
    const maq_head_mesh_data mesh = made.data();
    double sum = 0;
    for (uint32_t i = 0; i < mesh.vertex_count; ++i) sum += mesh.colours_rgb[3 * i];
    return sum / mesh.vertex_count;
  };
  EXPECT_GT(red(previews.front()), red(previews.back()) + 5);
  EXPECT_NEAR(red(previews.back()), red(head), 5);
  const size_t before = previews.size();
  moved.set_preview(0, {});
  moved.fit(0.2);
  EXPECT_EQ(previews.size(), before);
  moved.set_preview(3600, [&](maquette::Head preview) { previews.push_back(std::move(preview)); });
  moved.fit(0.2);
  EXPECT_EQ(previews.size(), before + 1);
  for (const double wrong : {-1.0, 4000.0, std::nan("")}) {
    EXPECT_EQ(maq_head_builder_set_preview(moved.get(), wrong, nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
    expect_text("The time between previews");
  }
}

}  // namespace
}  // namespace api_head_rendering_tests
