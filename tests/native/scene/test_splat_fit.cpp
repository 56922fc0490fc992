// Splats fitted to photos: the gradients of the renderer, and what a fit finds again.
#include "scene/splats/splat_fit.h"

#include <gtest/gtest.h>

#include "core/math/rotation.h"
#include "scene/splats/splat_holes.h"
#include "scene/splats/splat_renderer.h"
#include "scene/splats/tile_blending.h"
#include "support/expect_error.h"

namespace {

using maq::kTilePixels;
using maq::ProjectedSplat;
using maq::Vec3;

ProjectedSplat ellipse_of_pixels(float x, float y, float curvature, float slope, float falloff, float log_opacity,
                                 float depth) {
  ProjectedSplat splat{};
  splat.x = x, splat.y = y, splat.curvature = curvature, splat.slope = slope, splat.falloff = falloff;
  splat.log_opacity = log_opacity, splat.depth = depth;
  splat.rgb[0] = 0.8f, splat.rgb[1] = 0.3f * depth / 5, splat.rgb[2] = 0.6f;
  return splat;
}

// A loss that is linear in the colours of the pixels.
double loss_of(const std::vector<ProjectedSplat>& splats, const float loss[3][kTilePixels], maq::TileSums& sums) {
  std::vector<uint32_t> list(splats.size());
  for (uint32_t i = 0; i < list.size(); ++i) list[i] = i;
  maq::blend_tile(splats.data(), list.data(), list.data() + list.size(), 64, 32, sums);
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < kTilePixels; ++i) sum += double(loss[c][i]) * double(sums.rgb[c][i]);
  }
  return sum;
}

TEST(SplatFit, GradientsAreThoseOfFiniteDifferences) {
  std::vector<ProjectedSplat> splats = {
      ellipse_of_pixels(75, 40, 0.02f, 0.3f, 0.03f, -0.8f, 2), ellipse_of_pixels(80, 41, 0.01f, -0.5f, 0.02f, -1.5f, 3),
      ellipse_of_pixels(78, 38, 0.05f, 0, 0.01f, -0.2f, 4), ellipse_of_pixels(84, 44, 0.004f, 0.1f, 0.004f, -0.5f, 5)};
  float loss[3][kTilePixels];
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < kTilePixels; ++i) loss[c][i] = std::sin(0.05f * float(i) + float(c)) + 0.3f;
  }
  maq::TileSums sums;
  loss_of(splats, loss, sums);
  std::vector<maq::SplatGradient> gradients(splats.size());
  const uint32_t list[] = {0, 1, 2, 3};
  maq::tile_gradients(splats.data(), list, list + 4, 64, 32, loss, sums, gradients.data());
  for (size_t i = 0; i < splats.size(); ++i) {
    const auto check = [&](float& number, float found, float step, const char* name) {
      const float before = number;
      maq::TileSums ignored;
      number = before + step;
      const double high = loss_of(splats, loss, ignored);
      number = before - step;
      const double low = loss_of(splats, loss, ignored);
      number = before;
      const double wanted = (high - low) / (2 * double(step));
      // Pixels at the edge of a splat come and go with 1/255.
      EXPECT_NEAR(double(found), wanted, 0.04 * std::abs(wanted) + 0.02 / double(step)) << name << " of " << i;
    };
    check(splats[i].log_opacity, gradients[i].log_opacity, 0.05f, "opacity");
    check(splats[i].curvature, gradients[i].curvature, 0.1f * splats[i].curvature, "curvature");
    check(splats[i].slope, gradients[i].slope, 0.02f, "slope");
    check(splats[i].falloff, gradients[i].falloff, 0.1f * splats[i].falloff, "falloff");
    check(splats[i].x, gradients[i].x, 0.1f, "x");
    check(splats[i].y, gradients[i].y, 0.1f, "y");
    for (int c = 0; c < 3; ++c) check(splats[i].rgb[c], gradients[i].rgb[c], 0.1f, "colour");
  }
}

TEST(SplatFit, ASplatThatEndsBetweenTheLastPixelsOfATileStaysInIt) {
  struct {
    float before[64];
    maq::TileSums sums;
    float behind[64];
  } memory{};
  const uint32_t list[] = {0, 1};
  for (float edge = 31.99f; edge < 32.01f; edge = std::nextafter(edge, 33.0f)) {
    // The first one gives the first pixels of the sums, which are behind the last, a value.
    const ProjectedSplat splats[] = {
        ellipse_of_pixels(3, 0, 0.01f, 0, 0.1f, -1, 1),
        ellipse_of_pixels(edge - 10, 15, (maq::kMaxFalloff - 0.1f) / 100, 0, 1e-6f, -0.1f, 2)};
    maq::blend_tile(splats, list, list + 2, 0, 0, memory.sums);
    for (const float value : memory.before) ASSERT_EQ(value, 0);
    for (const float value : memory.behind) ASSERT_EQ(value, 0);
  }
}

// Splats on a wavy wall.
maq::Splats wall_of_splats() {
  maq::Splats splats;
  for (int y = -12; y <= 12; ++y) {
    for (int x = -16; x <= 16; ++x) {
      maq::Splat splat;
      splat.position = {0.1 * x, 0.1 * y, 0.1 * std::sin(0.5 * x + 0.3 * y)};
      splat.scale = {0.06f, 0.04f, 0.01f};
      const float turn = 0.3f * float(x + y);
      splat.rotation = {std::cos(turn), 0.1f, 0, std::sin(turn)};
      splat.opacity = 0.9f;
      splat.colour = {0.5f + 0.4f * std::sin(float(x)), 0.5f + 0.4f * std::sin(float(y)), 0.4f};
      EXPECT_TRUE(splats.add(splat));
    }
  }
  return splats;
}

std::vector<maq::FitPhoto> photos_of_splats(const maq::Splats& splats) {
  std::vector<maq::FitPhoto> photos;
  maq::SplatRenderer renderer(splats, {});
  for (int i = 0; i < 6; ++i) {
    maq::FitPhoto photo;
    photo.camera.width_px = 120;
    photo.camera.height_px = 90;
    photo.camera.fx_px = photo.camera.fy_px = 90;
    photo.camera.cx_px = 60;
    photo.camera.cy_px = 45;
    photo.camera.centre = {0.5 * (i - 2.5), 0.3 * (i % 3 - 1), -2.5};
    const maq::Mat3 turn = maq::exp_rotation({0.1 * (i % 2), -0.1 * (i - 2.5), 0.05 * i});
    std::copy(turn.begin(), turn.end(), photo.camera.rotation.begin());
    maq::RenderedImage image;
    renderer.render(photo.camera, image);
    photo.bgr = image.bgr;
    photos.push_back(photo);
  }
  return photos;
}

TEST(SplatFit, EveryKindOfNumberIsFoundAgain) {
  const maq::Splats truth = wall_of_splats();
  const std::vector<maq::FitPhoto> photos = photos_of_splats(truth);
  const auto fit = [&](const char* kind, double factor, auto&& spoil) {
    maq::Splats splats = truth;
    for (size_t i = 0; i < splats.count(); ++i) spoil(splats, i);
    maq::SplatFitOptions options;
    options.seconds = 1e6;
    options.max_steps = 240;
    const maq::SplatFitErrors errors = maq::fit_splats(splats, photos, options);
    EXPECT_EQ(errors.steps, 240u);
    EXPECT_LT(errors.last * factor, errors.first) << kind;
  };
  fit("colour", 20, [](maq::Splats& s, size_t i) { s.colour[3 * i + i % 3] = 0.5f; });
  fit("opacity", 8, [](maq::Splats& s, size_t i) { s.opacity[i] = i % 2 == 0 ? 0.5f : 0.98f; });
  fit("scale", 8, [](maq::Splats& s, size_t i) { s.scale[3 * i + i % 2] *= i % 3 == 0 ? 0.5f : 1.6f; });
  fit("rotation", 2, [](maq::Splats& s, size_t i) {
    const float turn = 0.3f * float(i % 5);
    const float q[4] = {std::cos(turn), 0, 0, std::sin(turn)};
    std::copy(q, q + 4, &s.rotation[4 * i]);
  });
  fit("position", 3, [](maq::Splats& s, size_t i) { s.position[3 * i + i % 2] += i % 3 == 0 ? 0.02f : -0.02f; });
}

TEST(SplatFit, InvalidPixelsDoNotCount) {
  const maq::Splats truth = wall_of_splats();
  std::vector<maq::FitPhoto> photos = photos_of_splats(truth);
  for (maq::FitPhoto& photo : photos) {
    photo.valid.assign(photo.bgr.size() / 3, 1);
    for (size_t i = 0; i < photo.valid.size(); i += 2) {
      photo.valid[i] = 0;
      photo.bgr[3 * i] = photo.bgr[3 * i + 1] = photo.bgr[3 * i + 2] = 255;
    }
  }
  maq::Splats splats = truth;
  maq::SplatFitOptions options;
  options.max_steps = 6;
  EXPECT_LT(maq::fit_splats(splats, photos, options).first, 1e-4);
}

TEST(SplatFit, HolesAreFilledWithWhatThePhotosShow) {
  const maq::Splats truth = wall_of_splats();
  const std::vector<maq::FitPhoto> photos = photos_of_splats(truth);
  maq::Splats splats;
  for (size_t i = 0; i < truth.count(); ++i) {
    const maq::Splat splat = maq::splat_at(truth, i);
    if (std::abs(splat.position[0]) > 0.5 || std::abs(splat.position[1]) > 0.5) {
      EXPECT_TRUE(splats.add(splat));
    }
  }
  maq::SplatFitOptions options;
  options.max_steps = 6;
  maq::Splats with_hole = splats;
  const double before = maq::fit_splats(with_hole, photos, options).first;
  const size_t count = splats.count(), added = maq::fill_holes(splats, photos, 2);
  EXPECT_EQ(splats.count(), count + added);
  EXPECT_GT(added, 10u);
  for (size_t i = count; i < splats.count(); ++i) {
    EXPECT_NEAR(double(splats.position[3 * i + 2]) + splats.origin[2], 0, 0.8) << "in front of or behind the wall";
  }
  EXPECT_LT(maq::fit_splats(splats, photos, options).first, 0.4 * before);
}

TEST(SplatFit, ACancelledFitKeepsItsLastStepAndWrongPhotosAreRefused) {
  const maq::Splats truth = wall_of_splats();
  std::vector<maq::FitPhoto> photos = photos_of_splats(truth);
  maq::Splats splats = truth;
  splats.colour.assign(splats.colour.size(), 0.5f);
  const maq::SplatFitErrors errors =
      maq::fit_splats(splats, photos, {}, [](double, const std::string&) { return false; });
  EXPECT_EQ(errors.steps, 1u);
  EXPECT_NE(splats.colour, std::vector<float>(splats.colour.size(), 0.5f));
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "no photos", [&] { maq::fit_splats(splats, {}, {}); });
  photos[2].bgr.resize(30);
  expect_error(MAQ_ERROR_INVALID_ARGUMENT, "10 pixels", [&] { maq::fit_splats(splats, photos, {}); });
}

}  // namespace
