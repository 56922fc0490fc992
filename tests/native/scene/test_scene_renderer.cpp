// Images of scenes: against torch, with any number of threads, with work left out and not, and the extreme cases.
#include "scene/render/scene_renderer.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "image/files/image_file.h"
#include "scene/format/scene_packing.h"
#include "support/expect_error.h"
#include "support/samples/synthetic_scene.h"
#include "support/samples/tiny_scene.h"

namespace {

using maq::PinholeCamera;
using maq::RenderOptions;
using maq::Scene;
using maq::SceneRenderer;

std::shared_ptr<maq::SceneNetworks> networks() {
  static const std::shared_ptr<maq::SceneNetworks> made = tiny_scene::networks();
  return made;
}

// The points of the tiny scene as torch modelled them.
maq::FittedPoints tiny_points() {
  const maq::Capture capture = tiny_scene::capture();
  maq::FittedPoints points;
  points.origin = capture.cloud.origin;
  points.up = capture.up;
  points.background = tiny_scene::expected_background();
  for (const tiny_scene::Descriptor& expected : tiny_scene::expected_descriptors()) {
    points.x.push_back(capture.cloud.x[expected.index]);
    points.y.push_back(capture.cloud.y[expected.index]);
    points.z.push_back(capture.cloud.z[expected.index]);
    points.views.push_back(expected.views);
    points.view_dependence.push_back(expected.view_dependence);
    points.constant_terms.insert(points.constant_terms.end(), std::begin(expected.constant_terms),
                                 std::end(expected.constant_terms));
    points.linear_terms.insert(points.linear_terms.end(), std::begin(expected.linear_terms),
                               std::end(expected.linear_terms));
  }
  return points;
}

Scene packed(const maq::FittedPoints& points, maq::CoefficientFormat coefficients) {
  maq::ScenePacking packing;
  packing.coefficients = coefficients;
  packing.min_view_dependence = 0;
  packing.positions =
      coefficients == maq::CoefficientFormat::kFloat32 ? maq::PositionFormat::kFloat32 : maq::PositionFormat::kUint16;
  return make_scene(points, packing);
}

struct ExpectedView {
  PinholeCamera camera;
  std::vector<uint8_t> bgr;
};

std::vector<ExpectedView> views_by_torch() {
  const std::string folder = std::string(MAQ_TEST_DATA) + "/rendered_views";
  std::vector<ExpectedView> views;
  for (const nlohmann::json& entry : nlohmann::json::parse(read_text(folder + "/views.json"))) {
    ExpectedView view;
    PinholeCamera& camera = view.camera;
    camera = {entry["width_px"], entry["height_px"], entry["fx_px"], entry["fy_px"], entry["cx_px"], entry["cy_px"], {},
              entry["centre"]};
    for (size_t i = 0; i < 9; ++i) camera.rotation[i] = entry["rotation"][i / 3][i % 3];
    maq::Frame frame;
    maq::read_image_file(folder + "/" + entry["picture"].get<std::string>(), frame);
    const uint8_t* pixels = frame.image.planes[0].data;
    view.bgr.assign(pixels, pixels + size_t(3) * frame.image.width_px * frame.image.height_px);
    views.push_back(std::move(view));
  }
  return views;
}

double psnr(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  EXPECT_EQ(a.size(), b.size());
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += double(a[i] - b[i]) * double(a[i] - b[i]);
  return sum == 0 ? 99 : 10 * std::log10(255 * 255 * double(a.size()) / sum);
}

struct Rendered : maq::RenderedImage {
  maq::RenderCounts counts;
};

Rendered render(const Scene& scene, const PinholeCamera& camera, const RenderOptions& options = {}) {
  SceneRenderer renderer(scene, networks(), options);
  Rendered picture;
  picture.counts = renderer.render(camera, picture);
  return picture;
}

// Everything that an image promises whatever the camera is.
void expect_sound(const Rendered& picture, const PinholeCamera& camera) {
  ASSERT_EQ(picture.width_px, camera.width_px);
  ASSERT_EQ(picture.height_px, camera.height_px);
  const size_t pixels = size_t(camera.width_px) * size_t(camera.height_px);
  ASSERT_EQ(picture.bgr.size(), 3 * pixels);
  ASSERT_EQ(picture.alpha.size(), pixels);
  ASSERT_EQ(picture.depth.size(), pixels);
  for (const float depth : picture.depth) ASSERT_TRUE(depth >= 0 && std::isfinite(depth));
}

void expect_same(const Rendered& a, const Rendered& b) {
  EXPECT_EQ(a.bgr, b.bgr);
  EXPECT_EQ(a.alpha, b.alpha);
  EXPECT_EQ(a.depth, b.depth);
}

TEST(SceneRenderer, RendersWhatTorchRenders) {
  const Scene scene = packed(tiny_points(), maq::CoefficientFormat::kFloat32);
  const std::vector<ExpectedView> views = views_by_torch();
  ASSERT_GE(views.size(), 5u);
  size_t rotated = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    const Rendered picture = render(scene, views[i].camera);
    expect_sound(picture, views[i].camera);
    rotated += picture.counts.is_rotated ? 1 : 0;
    const double found = psnr(picture.bgr, views[i].bgr);
    std::printf("view %zu: %.1f dB%s\n", i, found, picture.counts.is_rotated ? ", rotated" : "");
    EXPECT_GE(found, 45) << i;
    // So that the bar constant_terms something: an image of one colour is far below it.
    double mean = 0;
    for (const uint8_t value : views[i].bgr) mean += value / double(views[i].bgr.size());
    EXPECT_LE(psnr(std::vector<uint8_t>(views[i].bgr.size(), uint8_t(mean)), views[i].bgr), 25) << i;
  }
  EXPECT_EQ(rotated, views.size() - 1);
}

TEST(SceneRenderer, StoredIn8BitsItShowsNearlyTheSame) {
  const Scene exact = packed(tiny_points(), maq::CoefficientFormat::kFloat32);
  const Scene in_16 = packed(tiny_points(), maq::CoefficientFormat::kInt16),
              in_8 = packed(tiny_points(), maq::CoefficientFormat::kInt8);
  double squares_16 = 0, squares_8 = 0;
  const std::vector<ExpectedView> views = views_by_torch();
  for (const ExpectedView& view : views) {
    const Rendered expected = render(exact, view.camera);
    const double found_16 = psnr(render(in_16, view.camera).bgr, expected.bgr);
    const double found_8 = psnr(render(in_8, view.camera).bgr, expected.bgr);
    std::printf("against float: int16 %.1f dB, int8 %.1f dB\n", found_16, found_8);
    squares_16 += std::pow(10, -found_16 / 10) / double(views.size());
    squares_8 += std::pow(10, -found_8 / 10) / double(views.size());
  }
  EXPECT_GE(-10 * std::log10(squares_16), 50);
  EXPECT_GE(-10 * std::log10(squares_8), 48);
}

TEST(SceneRenderer, AnyNumberOfThreadsRendersTheSamePicture) {
  // Four points at each position: ties everywhere.
  const Scene scene = packed(synthetic_points(30000, 3, 1, {0, 0, 0}, 4), maq::CoefficientFormat::kInt8);
  for (const double roll : {0.0, 0.6}) {
    PinholeCamera camera = camera_of(200, 150, 70);
    camera.rotation = rotation_of(1, 0, 0, roll);
    const Rendered expected = render(scene, camera);
    EXPECT_EQ(expected.counts.is_rotated, roll != 0);
    EXPECT_GT(expected.counts.shaded_points, 2000u);
    for (const int threads : {2, 3}) {
      RenderOptions options;
      options.threads = threads;
      SceneRenderer renderer(scene, networks(), options);
      for (int again = 0; again < 3; ++again) {
        Rendered picture;
        picture.counts = renderer.render(camera, picture);
        expect_same(picture, expected);
      }
    }
  }
}

TEST(SceneRenderer, OneRendererShowsOneViewAfterAnotherAsNewOnesDo) {
  const Scene scene = packed(synthetic_points(20000), maq::CoefficientFormat::kInt8);
  RenderOptions options;
  options.threads = 2;
  SceneRenderer renderer(scene, networks(), options);
  Rendered picture;
  std::mt19937 random(8);
  for (int i = 0; i < 10; ++i) {
    const PinholeCamera camera = random_camera(random);
    picture.counts = renderer.render(camera, picture);
    expect_same(picture, render(scene, camera));
  }
}

TEST(SceneRenderer, BlocksLeftOutChangeNothing) {
  const Scene scene = packed(synthetic_points(30000, 4), maq::CoefficientFormat::kInt8);
  RenderOptions all;
  all.skips_unseen_blocks = false;
  SceneRenderer skips(scene, networks(), {}), draws(scene, networks(), all);
  std::mt19937 random(9);
  uint64_t projected = 0, blocks = 0;
  for (int i = 0; i < 60; ++i) {
    const PinholeCamera camera = random_camera(random);
    Rendered found, expected;
    found.counts = skips.render(camera, found);
    expected.counts = draws.render(camera, expected);
    expect_same(found, expected);
    EXPECT_EQ(expected.counts.projected_blocks, scene.block_count);
    projected += found.counts.projected_blocks;
    blocks += scene.block_count;
  }
  EXPECT_LT(projected, blocks / 2);
}

TEST(SceneRenderer, EmptyPartsLeftOutChangeNothingThatIsCovered) {
  maq::FittedPoints points = synthetic_points(400);
  // Two groups: one right of the middle and above it, the other left and below.
  for (size_t i = 0; i < points.count(); ++i) {
    const float side = i % 2 == 0 ? points.z[i] : -points.z[i];
    points.x[i] = 0.1f * points.x[i] + 0.15f * side;
    points.y[i] = 0.1f * points.y[i] - 0.1f * side;
  }
  const Scene scene = packed(points, maq::CoefficientFormat::kFloat32);
  RenderOptions all, some;
  all.skips_empty_parts = false;
  all.background = some.background = std::array<uint8_t, 3>{10, 200, 30};
  for (const double roll : {0.0, 0.3}) {
    for (const double off : {0.0, 0.12, -0.25}) {
      PinholeCamera camera = camera_of(640, 480, 60);
      camera.rotation = rotation_of(1, 0, off, roll);
      const Rendered found = render(scene, camera, some), expected = render(scene, camera, all);
      EXPECT_LE(found.counts.refined_pixels, 3 * expected.counts.refined_pixels / 4);
      EXPECT_EQ(expected.counts.refined_pixels, expected.counts.frame_pixels);
      EXPECT_EQ(found.alpha, expected.alpha);
      EXPECT_EQ(found.depth, expected.depth);
      size_t covered = 0;
      for (size_t i = 0; i < found.alpha.size(); ++i) {
        covered += found.alpha[i] > 0 ? 1 : 0;
        for (size_t c = 0; c < 3; ++c) {
          // The sums of a network of another size may be made in another order.
          ASSERT_NEAR(found.bgr[3 * i + c], expected.bgr[3 * i + c], 1) << i << " " << roll << " " << off;
        }
      }
      EXPECT_GT(covered, 1000u);
    }
  }
}

TEST(SceneRenderer, DepthIsThatOfThePointsAlsoWhenRotated) {
  // A wall across the axis, 2 away, wider than the image.
  maq::FittedPoints points = synthetic_points(20000);
  for (float& z : points.z) z = 2;
  const Scene scene = packed(points, maq::CoefficientFormat::kInt8);
  for (const double roll : {0.0, 0.4, M_PI / 2}) {
    PinholeCamera camera = camera_of(101, 77, 50);
    camera.rotation = rotation_of(std::cos(roll / 2), 0, 0, std::sin(roll / 2));
    const Rendered picture = render(scene, camera);
    EXPECT_EQ(picture.counts.is_rotated, roll != 0);
    for (const float depth : picture.depth) ASSERT_NEAR(depth, 2, 1e-4);
    for (const uint8_t alpha : picture.alpha) ASSERT_EQ(alpha, 255);
  }
}

// A rolled camera takes the same image, rotated.
TEST(SceneRenderer, ARolledCameraTakesTheRotatedPicture) {
  const Scene scene = packed(synthetic_points(20000), maq::CoefficientFormat::kFloat32);
  const PinholeCamera level = camera_of(96, 64, 60);
  PinholeCamera portrait = camera_of(64, 96, 60);
  portrait.fx_px = portrait.fy_px = level.fx_px;
  portrait.rotation = {0, 1, 0, -1, 0, 0, 0, 0, 1};  // its right is down in the world
  const Rendered expected = render(scene, level), found = render(scene, portrait);
  EXPECT_TRUE(found.counts.is_rotated);
  EXPECT_FALSE(expected.counts.is_rotated);
  // At the frame's right and lower edges the rotated one sees more around the image, and the refiner more of the
  // scene.
  size_t same = 0;
  for (size_t y = 0; y < 64; ++y) {
    for (size_t x = 0; x < 96; ++x) {
      const size_t there = y * 96 + x, here = (95 - x) * 64 + y;
      ASSERT_EQ(found.alpha[here], expected.alpha[there]);
      ASSERT_EQ(found.depth[here], expected.depth[there]);
      same += std::abs(found.bgr[3 * here] - expected.bgr[3 * there]) <= 1 ? 1 : 0;
    }
  }
  EXPECT_GT(same, size_t(96 * 64 / 4));
}

TEST(SceneRenderer, CamerasOfEveryKind) {
  const Scene scene = packed(synthetic_points(3000), maq::CoefficientFormat::kInt8);
  SceneRenderer renderer(scene, networks(), {});
  Rendered picture;
  uint64_t shaded = 0;
  for (const double degrees : {1.0, 60.0, 170.0}) {
    for (const auto& [width, height] : {std::pair(33, 61), std::pair(1, 1), std::pair(1, 50), std::pair(64, 48)}) {
      PinholeCamera camera = camera_of(width, height, degrees);
      for (const auto& rotation : {rotation_of(1, 0, 0, 0), rotation_of(1, 0.1, 0, 0.5), rotation_of(1, 1, 0, 0)}) {
        camera.rotation = rotation;              // the last one looks along the up axis
        for (const double along : {0.0, 3.0}) {  // in front of the points, and among them
          camera.centre = {0.1, 0.05, along};
          picture.counts = renderer.render(camera, picture);
          expect_sound(picture, camera);
          shaded += picture.counts.shaded_points;
          PinholeCamera odd = camera;
          odd.fy_px *= 1.7;
          odd.cx_px += 2 * width;
          picture.counts = renderer.render(odd, picture);
          expect_sound(picture, odd);
        }
      }
    }
  }
  EXPECT_GT(shaded, 1000u);
}

TEST(SceneRenderer, OnePointIsOnePoint) {
  maq::FittedPoints points = synthetic_points(1);
  points.x[0] = points.y[0] = 0;
  for (const auto kind : {maq::CoefficientFormat::kFloat32, maq::CoefficientFormat::kInt8}) {
    const PinholeCamera camera = camera_of(65, 33, 60);
    const Rendered picture = render(packed(points, kind), camera);
    EXPECT_EQ(picture.counts.shaded_points, 1u);
    EXPECT_EQ(picture.alpha[16 * 65 + 32], 255);
    EXPECT_NEAR(picture.depth[16 * 65 + 32], points.z[0], 1e-5);
    EXPECT_EQ(picture.alpha[0], 0);
  }
}

TEST(SceneRenderer, ScenesInAnyUnitLookTheSame) {
  const auto rendered = [](double unit, const std::array<double, 3>& origin) {
    maq::FittedPoints points = synthetic_points(5000, 6, 1, origin);
    for (std::vector<float>* axis : {&points.x, &points.y, &points.z}) {
      for (float& value : *axis) value = float(value * unit);  // by a power of two: exact
    }
    PinholeCamera camera = camera_of(96, 80, 60);
    camera.centre = origin;
    return render(packed(points, maq::CoefficientFormat::kFloat32), camera);
  };
  const Rendered expected = rendered(1, {0, 0, 0});
  for (const double unit : {std::ldexp(1.0, -10), std::ldexp(1.0, 20)}) {
    for (const double away : {0.0, 1e6}) {
      const Rendered found = rendered(unit, {away * unit, 0, -away * unit});
      EXPECT_EQ(found.alpha, expected.alpha);
      EXPECT_GE(psnr(found.bgr, expected.bgr), 55);
    }
  }
}

}  // namespace
