// Images of splats: against a plain renderer in double precision, by any number of threads, and the extreme cases.
#include <gtest/gtest.h>

#include <limits>

#include "core/math/rotation.h"
#include "scene/splats/splat_renderer.h"
#include "support/expect_error.h"
#include "support/samples/made_splats.h"

namespace {

using maq::PinholeCamera;
using maq::RenderedImage;
using maq::SplatRenderer;
using maq::SplatRenderOptions;
using maq::Vec3;

maq::Splats splats_of(const MadeSplats& made) {
  maq::Splats splats;
  splats.sh_degree = made.degree;
  for (const MadeSplat& from : made.splats) {
    maq::Splat splat;
    splat.position = from.position;
    for (size_t k = 0; k < 3; ++k) {
      splat.scale[k] = float(from.scale[k]);
      splat.colour[k] = float(0.5 + 0.28209479177 * from.coefficient[k]);
    }
    for (size_t k = 0; k < 4; ++k) splat.rotation[k] = float(from.rotation[k]);
    splat.opacity = float(from.opacity);
    EXPECT_TRUE(splats.add(splat));
    for (int k = 0; k < 3 * made.terms(); ++k) splats.sh.push_back(maq::sh_steps(from.sh[size_t(k)]));
  }
  return splats;
}

PinholeCamera splat_camera_at(Vec3 eye, Vec3 target, int width_px = 96, int height_px = 64, double focal_px = 70) {
  const Vec3 forward = maq::normalized(target - eye);
  const Vec3 right =
      maq::normalized(maq::any_orthogonal(forward) + 0.3 * maq::cross(forward, maq::any_orthogonal(forward)));
  const Vec3 down = maq::cross(forward, right);
  PinholeCamera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.fx_px = focal_px;
  camera.fy_px = 0.9 * focal_px;
  camera.cx_px = 0.53 * width_px;
  camera.cy_px = 0.46 * height_px;
  camera.rotation = {right.x, right.y, right.z, down.x, down.y, down.z, forward.x, forward.y, forward.z};
  camera.centre = {eye.x, eye.y, eye.z};
  return camera;
}

struct ReferenceSplat {
  double depth, x, y, xx, xy, yy, opacity, rgb[3];
};

// Kerbl et al. 2023, section 4, as it is written there.
bool project_splat(const MadeSplat& splat, int degree, const PinholeCamera& camera, bool is_antialiased,
                   ReferenceSplat& to) {
  const double* const r = camera.rotation.data();
  double away[3], at[3] = {}, m[3][3], covariance[3][3] = {};
  for (size_t k = 0; k < 3; ++k) away[k] = splat.position[k] - camera.centre[k];
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) at[row] += r[3 * row + k] * away[k];
  }
  const double w = splat.rotation[0], x = splat.rotation[1], y = splat.rotation[2], z = splat.rotation[3];
  const double rotation[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                              2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                              2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) {
      m[row][k] = 0;
      for (size_t i = 0; i < 3; ++i) m[row][k] += r[3 * row + i] * rotation[3 * i + k] * splat.scale[k];
    }
  }
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) {
      for (size_t i = 0; i < 3; ++i) covariance[row][k] += m[row][i] * m[k][i];
    }
  }
  if (!(at[2] > 1e-6) || at[2] * at[2] <= covariance[2][2]) return false;
  const auto limited = [](double slope, double centre, double size, double focal) {
    return std::clamp(slope, (-0.5 - 0.15 * size - centre) / focal, (size - 0.5 + 0.15 * size - centre) / focal);
  };
  const double u = at[0] / at[2], v = at[1] / at[2];
  const double lu = limited(u, camera.cx_px, camera.width_px, camera.fx_px),
               lv = limited(v, camera.cy_px, camera.height_px, camera.fy_px);
  const double j[2][3] = {{camera.fx_px / at[2], 0, -camera.fx_px * lu / at[2]},
                          {0, camera.fy_px / at[2], -camera.fy_px * lv / at[2]}};
  double flat[2][2] = {};
  for (size_t a = 0; a < 2; ++a) {
    for (size_t b = 0; b < 2; ++b) {
      for (size_t i = 0; i < 3; ++i) {
        for (size_t k = 0; k < 3; ++k) flat[a][b] += j[a][i] * covariance[i][k] * j[b][k];
      }
    }
  }
  to = {at[2],
        camera.fx_px * u + camera.cx_px,
        camera.fy_px * v + camera.cy_px,
        flat[0][0] + 0.3,
        flat[0][1],
        flat[1][1] + 0.3,
        splat.opacity,
        {}};
  if (is_antialiased) {
    const double before = std::max(flat[0][0] * flat[1][1] - flat[0][1] * flat[0][1], 0.0);
    to.opacity *= std::sqrt(std::max(before / (to.xx * to.yy - to.xy * to.xy), 1e-12));
  }
  const Vec3 d = maq::normalized({away[0], away[1], away[2]});
  const double basis[15] = {-0.4886025119 * d.y,
                            0.4886025119 * d.z,
                            -0.4886025119 * d.x,
                            1.0925484306 * d.x * d.y,
                            -1.0925484306 * d.y * d.z,
                            0.3153915653 * (2 * d.z * d.z - d.x * d.x - d.y * d.y),
                            -1.0925484306 * d.x * d.z,
                            0.5462742153 * (d.x * d.x - d.y * d.y),
                            -0.5900435899 * d.y * (3 * d.x * d.x - d.y * d.y),
                            2.8906114426 * d.x * d.y * d.z,
                            -0.4570457995 * d.y * (4 * d.z * d.z - d.x * d.x - d.y * d.y),
                            0.3731763326 * d.z * (2 * d.z * d.z - 3 * d.x * d.x - 3 * d.y * d.y),
                            -0.4570457995 * d.x * (4 * d.z * d.z - d.x * d.x - d.y * d.y),
                            1.4453057213 * d.z * (d.x * d.x - d.y * d.y),
                            -0.5900435899 * d.x * (d.x * d.x - 3 * d.y * d.y)};
  for (size_t c = 0; c < 3; ++c) {
    to.rgb[c] = 0.5 + 0.28209479177 * splat.coefficient[c];
    for (size_t term = 0; term < size_t((degree + 1) * (degree + 1) - 1); ++term) {
      to.rgb[c] += basis[term] * splat.sh[3 * term + c];
    }
    to.rgb[c] = std::max(to.rgb[c], 0.0);
  }
  return true;
}

struct ReferenceImage {
  std::vector<double> rgb, alpha, depth;
};

ReferenceImage reference_image(const MadeSplats& made, const PinholeCamera& camera, bool is_antialiased = false) {
  std::vector<ReferenceSplat> splats;
  for (const MadeSplat& splat : made.splats) {
    ReferenceSplat projected{};
    if (project_splat(splat, made.degree, camera, is_antialiased, projected)) splats.push_back(projected);
  }
  std::stable_sort(splats.begin(), splats.end(),
                   [](const ReferenceSplat& a, const ReferenceSplat& b) { return a.depth < b.depth; });
  ReferenceImage image;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      double through = 1, rgb[3] = {}, depth = 0;
      for (const ReferenceSplat& splat : splats) {
        const double dx = x - splat.x, dy = y - splat.y, determinant = splat.xx * splat.yy - splat.xy * splat.xy;
        const double power = (splat.yy * dx * dx - 2 * splat.xy * dx * dy + splat.xx * dy * dy) / (2 * determinant);
        const double weight = std::min(0.99, splat.opacity * std::exp(-power));
        if (weight < 1.0 / 255) continue;
        for (size_t c = 0; c < 3; ++c) rgb[c] += through * weight * splat.rgb[c];
        depth += through * weight * splat.depth;
        through *= 1 - weight;
      }
      image.rgb.insert(image.rgb.end(), rgb, rgb + 3);
      image.alpha.push_back(1 - through);
      image.depth.push_back(through < 1 ? depth / (1 - through) : 0);
    }
  }
  return image;
}

RenderedImage rendered_splats(const maq::Splats& splats, const PinholeCamera& camera, int threads = 2) {
  SplatRenderOptions options;
  options.threads = threads;
  SplatRenderer renderer(splats, options);
  RenderedImage image;
  renderer.render(camera, image);
  return image;
}

// Splats at the edge of what a pixel shows are there or not by rounding: 1/255 each.
void expect_reference(const MadeSplats& made, const PinholeCamera& camera, bool is_antialiased = false) {
  maq::Splats splats = splats_of(made);
  splats.is_antialiased = is_antialiased;
  const RenderedImage image = rendered_splats(splats, camera);
  const ReferenceImage wanted = reference_image(made, camera, is_antialiased);
  double sum = 0, covered = 0;
  for (size_t i = 0; i < wanted.alpha.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) {
      const double value = std::min(255 * wanted.rgb[3 * i + c], 255.0);
      const double error = std::abs(double(image.bgr[3 * i + 2 - c]) - value);
      ASSERT_LE(error, 3.5) << "pixel " << i << " channel " << c;
      sum += error;
    }
    covered += wanted.alpha[i];
    ASSERT_NEAR(double(image.alpha[i]), 255 * wanted.alpha[i], 3.5) << "pixel " << i;
    ASSERT_TRUE(std::isfinite(image.depth[i]));
    if (wanted.alpha[i] > 0.2) {
      ASSERT_NEAR(double(image.depth[i]) / wanted.depth[i], 1, 0.02) << "pixel " << i;
    }
  }
  EXPECT_LT(sum / double(3 * wanted.alpha.size()), 0.35);
  EXPECT_GT(covered, 50) << "the view shows nothing";
}

TEST(SplatRendering, IsThatOfAPlainRendererInDoublePrecision) {
  for (int degree = 0; degree <= 3; ++degree) {
    const MadeSplats made = made_splats(700, degree, unsigned(10 + degree));
    expect_reference(made, splat_camera_at({2.5, -0.7, 1}, {0, 0, 0}));
    expect_reference(made, splat_camera_at({-0.4, 0.2, -2}, {0.2, 0, 0.1}, 67, 81, 90));
  }
}

TEST(SplatRendering, FaintsWhatIsSmallerThanAPixelIfSplatsWereTrainedSo) {
  MadeSplats made = made_splats(3000, 1, 4);
  for (MadeSplat& splat : made.splats) {
    for (double& scale : splat.scale) scale *= 0.2;
  }
  expect_reference(made, splat_camera_at({2.5, -0.7, 1}, {0, 0, 0}), true);
}

TEST(SplatRendering, ACameraAmongTheSplatsSeesThemAsTheReferenceDoes) {
  const MadeSplats made = made_splats(900, 1, 5);
  expect_reference(made, splat_camera_at({0.1, 0.05, -0.1}, {1, 0.3, 0}));
  // At the very place of a splat.
  const auto& at = made.splats[17].position;
  expect_reference(made, splat_camera_at({at[0], at[1], at[2]}, {0, 0, 0}));
}

TEST(SplatRendering, ThinAndLongOnesAreNotLost) {
  MadeSplats made = made_splats(400, 0, 6);
  for (size_t i = 0; i < made.splats.size(); ++i) made.splats[i].scale = {0.4, 0.4e-3, i % 2 == 0 ? 0.4e-3 : 0.05};
  expect_reference(made, splat_camera_at({3, 0.5, 0.4}, {0, 0, 0}));
  expect_reference(made, splat_camera_at({1.2, 0.1, 0}, {0, 0, 0}, 128, 128, 110));
}

TEST(SplatRendering, TheUnitAndTheDistanceToTheOriginDoNotMatter) {
  for (const double size : {1e-3, 1e6}) {
    expect_reference(made_splats(300, 2, 7, size), splat_camera_at({2.5 * size, 0, size}, {0, 0, 0}));
  }
  const double away = 1e6;
  expect_reference(made_splats(300, 2, 8, 1, {away, -away, away}),
                   splat_camera_at({away + 2.5, -away + 0.3, away}, {away, -away, away}));
}

TEST(SplatRendering, ImagesOfEverySizeAreRight) {
  const MadeSplats made = made_splats(200, 0, 9);
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(31, 33), std::pair(150, 2), std::pair(2, 150)}) {
    const PinholeCamera camera = splat_camera_at({2, 0, 0.3}, {0, 0, 0}, width, height, 60);
    const RenderedImage image = rendered_splats(splats_of(made), camera);
    const ReferenceImage wanted = reference_image(made, camera);
    ASSERT_EQ(image.alpha.size(), wanted.alpha.size());
    for (size_t i = 0; i < wanted.alpha.size(); ++i) ASSERT_NEAR(double(image.alpha[i]), 255 * wanted.alpha[i], 3.5);
  }
}

TEST(SplatRendering, TheImageIsTheSameWithAnyNumberOfThreads) {
  MadeSplats made = made_splats(5000, 3, 12);
  for (size_t i = 0; i < 2000; ++i) made.splats.push_back(made.splats[i % 50]);  // of equal depth
  const maq::Splats splats = splats_of(made);
  const PinholeCamera camera = splat_camera_at({2, 0.4, 0.3}, {0, 0, 0}, 200, 150, 120);
  const RenderedImage one = rendered_splats(splats, camera, 1);
  for (const int threads : {2, 3, 7}) {
    const RenderedImage more = rendered_splats(splats, camera, threads);
    EXPECT_EQ(one.bgr, more.bgr);
    EXPECT_EQ(one.alpha, more.alpha);
    EXPECT_EQ(one.depth, more.depth);
  }
}

TEST(SplatRendering, AViewWithoutSplatsIsTheBackground) {
  SplatRenderOptions options;
  options.background = {10, 20, 30};
  SplatRenderer renderer(splats_of(made_splats(100, 1)), options);
  RenderedImage image;
  const maq::SplatRenderCounts counts = renderer.render(splat_camera_at({20, 0, 0}, {40, 0, 0}), image);
  EXPECT_EQ(counts.drawn_splats, 0u);
  for (size_t i = 0; i < image.alpha.size(); ++i) {
    ASSERT_EQ(image.alpha[i], 0);
    ASSERT_EQ(image.depth[i], 0);
    ASSERT_EQ(image.bgr[3 * i], 10);
    ASSERT_EQ(image.bgr[3 * i + 2], 30);
  }
}

TEST(SplatRendering, SplatsThatNoPixelShowsAreNoScene) {
  MadeSplats made = made_splats(10, 0);
  for (MadeSplat& splat : made.splats) splat.opacity = 0.003;
  const RenderedImage image = rendered_splats(splats_of(made), splat_camera_at({2, 0, 0}, {0, 0, 0}));
  EXPECT_EQ(*std::max_element(image.alpha.begin(), image.alpha.end()), 0);
}

TEST(SplatRendering, SplatsNearerThanAskedForAreLeftOut) {
  MadeSplats made = made_splats(1, 0);
  made.splats[0].position = {0, 0, 0};
  made.splats[0].scale = {0.1, 0.1, 0.1};
  made.splats[0].opacity = 0.9;
  const PinholeCamera camera = splat_camera_at({2, 0, 0}, {0, 0, 0});
  for (const double near : {1.9, 2.1}) {
    SplatRenderOptions options;
    options.near = near;
    SplatRenderer renderer(splats_of(made), options);
    RenderedImage image;
    EXPECT_EQ(renderer.render(camera, image).visible_splats, near < 2 ? 1u : 0u);
  }
}

TEST(SplatRendering, HugeTinyAndManyLayersStayFiniteAndBounded) {
  MadeSplats made = made_splats(3000, 0, 13);
  for (size_t i = 0; i < made.splats.size(); ++i) {
    const double size = std::pow(10.0, double(i % 19) - 10);  // 1e-10 to 1e8
    made.splats[i].scale = {size, i % 3 == 0 ? size * 1e-6 : size, size * 1e-3};
    if (i % 5 == 0) made.splats[i].position[i % 3] *= 1e9;
  }
  for (const Vec3 eye : {Vec3{2, 0, 0}, Vec3{0, 0, 0}, Vec3{1e6, 1e6, 0}}) {
    const RenderedImage image = rendered_splats(splats_of(made), splat_camera_at(eye, {0.1, 0, 0.2}));
    for (const float depth : image.depth) ASSERT_TRUE(std::isfinite(depth) && depth >= 0);
  }
}

TEST(SplatRendering, OptionsAndCamerasAreChecked) {
  const maq::Splats splats = splats_of(made_splats(1, 0));
  SplatRenderOptions options;
  options.near = std::numeric_limits<double>::quiet_NaN();
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "finite", [&] { SplatRenderer(splats, options); });
  PinholeCamera camera = splat_camera_at({2, 0, 0}, {0, 0, 0});
  camera.fx_px = 0;
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "camera", [&] { rendered_splats(splats, camera); });
}

}  // namespace
