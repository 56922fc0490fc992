// The image of a texture: what photos see well is theirs, all else the network's, and no step lies between.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "head/mesh/marching_cubes.h"
#include "head/mesh/mesh_cleanup.h"
#include "head/texture/smooth_fill.h"
#include "head/texture/texture_bake.h"
#include "head/texture/texture_layout.h"
#include "support/expect_error.h"

namespace texture_bake_tests {
namespace {

using namespace maq::head;  // NOLINT
using maq::Vec3;
using Rgb = std::array<int, 3>;

constexpr int kSide = 256;
constexpr uint8_t kOwn = 100;  // the mesh's colour

// Cut off below.
template <class Field>
HeadMesh mesh_of(Field&& field, float cut_dm = 0.9f) {
  MarchingCubesOptions options;
  options.box_min = {-2.2f, -2.2f, -2.2f}, options.box_max = {2.2f, 2.2f, 2.2f}, options.cell = 0.06f;
  maq::WorkerThreads threads(1);
  HeadMesh mesh = marching_cubes(
      [&](const float* x, const float* y, const float* z, float* f, size_t n) {
        for (size_t i = 0; i < n; ++i) f[i] = std::max(field(x[i], y[i], z[i]), -cut_dm - z[i]);
      },
      options, threads);
  set_normals(mesh);
  mesh.template_points = mesh.positions;
  mesh.colours.assign(mesh.positions.size(), kOwn);
  set_texture_coordinates(mesh, find_cap(mesh, {0, 0, -1}, cut_dm, 0.003f));
  return mesh;
}

HeadMesh ball() {
  return mesh_of([](float x, float y, float z) { return std::hypot(x, y, z) - 1; });
}

// From 6 dm away in the direction of `from`, which is level, of length 1.
TexturePhoto photo_from(Vec3 from, Rgb rgb, float matte = 1) {
  TexturePhoto photo;
  const Vec3 forward = -from, down{0, 0, -1}, right = cross(down, forward);
  photo.camera.head_to_camera.rotation = {right.x, right.y,   right.z,   down.x,   down.y,
                                          down.z,  forward.x, forward.y, forward.z};
  photo.camera.head_to_camera.translation = {0, 0, 6};
  photo.camera.focal_px = 400, photo.camera.cx_px = photo.camera.cy_px = 99.5;
  photo.camera.width_px = photo.camera.height_px = 200;
  for (int i = 0; i < 200 * 200; ++i) {
    for (const int value : rgb) photo.rgb.push_back(uint8_t(value));
  }
  photo.matte_side = 10;
  photo.matte.assign(100, matte);
  return photo;
}

TextureImage bake(const HeadMesh& mesh, const std::vector<TexturePhoto>& photos, int thread_count = 1,
                  bool delight = false) {
  maq::WorkerThreads threads(thread_count);
  return bake_texture(mesh, photos, {kSide, delight}, threads);
}

Rgb at(const TextureImage& image, Vec3 point) {
  const auto place = texture_place(point);
  const size_t pixel = size_t(place[1] * kSide) * kSide + size_t(place[0] * kSide);
  return {image.bgr[3 * pixel + 2], image.bgr[3 * pixel + 1], image.bgr[3 * pixel]};
}

// Between neighbours in the disc of the surface.
int largest_step(const TextureImage& image) {
  int largest = 0;
  for (int y = 0; y < kSide - 1; ++y) {
    for (int x = 0; x < kSide - 1; ++x) {
      if (std::hypot(x - kSide / 2, y - kSide / 2) > 0.4 * kSide) continue;
      for (int c = 0; c < 3; ++c) {
        const auto value = [&](int column, int row) { return int(image.bgr[size_t((row * kSide + column) * 3 + c)]); };
        largest = std::max({largest, std::abs(value(x, y) - value(x + 1, y)), std::abs(value(x, y) - value(x, y + 1))});
      }
    }
  }
  return largest;
}

void expect_near(Rgb found, Rgb expected, int tolerance) {
  for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], tolerance);
}

constexpr Vec3 kFront{0, -1, 0}, kBack{0, 1, 0}, kLeft{1, 0, 0}, kRight{-1, 0, 0};

TEST(TextureBake, WhatAPhotoSeesIsItsAndTheRestHasItsLightWithoutAStep) {
  const TextureImage image = bake(ball(), {photo_from(kFront, {150, 120, 40})});
  ASSERT_EQ(image.side_px, kSide);
  expect_near(at(image, kFront), {150, 120, 40}, 1);
  expect_near(at(image, kBack), {150, 120, 40}, 3);
  EXPECT_LE(largest_step(image), 4);
  EXPECT_GT(image.photo_fraction, 0.1);
  EXPECT_LT(image.photo_fraction, 0.5) << "a photo does not see more than half of a ball";
}

TEST(TextureBake, HairThatAPhotoShowsDarkerIsDarkerBehind) {
  // The mesh is 130 below and 40 above; the photo shows 160 and 30.
  HeadMesh mesh = ball();
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    for (size_t c = 0; c < 3; ++c) mesh.colours[3 * i + c] = mesh.positions[3 * i + 2] > 0.2f ? 40 : 130;
  }
  TexturePhoto photo = photo_from(kFront, {160, 160, 160});
  for (int y = 0; y < 200; ++y) {
    // 5 dm from the camera, about, on the ball's front
    if ((99.5 - y) / 400 * 5.1 > 0.2) std::fill_n(&photo.rgb[size_t(y) * 600], 600, uint8_t(30));
  }
  const TextureImage image = bake(mesh, {photo});
  const int skin = at(image, maq::normalized({0, 1, -0.3}))[0], hair = at(image, maq::normalized({0, 1, 0.6}))[0];
  EXPECT_NEAR(skin, 160, 30);
  EXPECT_NEAR(hair, 30, 30);
}

TEST(TextureBake, ADarkEdgeOfWhatAPhotoSeesDoesNotDarkenTheBack) {
  TexturePhoto photo = photo_from(kFront, {150, 120, 100});
  for (size_t y = 0; y < 200; ++y) {
    for (size_t x = 0; x < 200; ++x) {  // the ball has a radius of 67 pixels
      if (std::hypot(double(x) - 99.5, double(y) - 99.5) > 50)
        std::fill_n(&photo.rgb[(y * 200 + x) * 3], 3, uint8_t(10));
    }
  }
  const TextureImage image = bake(ball(), {photo});
  expect_near(at(image, kFront), {150, 120, 100}, 1);
  EXPECT_GT(at(image, kBack)[0], 40);
}

TEST(TextureBake, ColoursThatNoPhotoShowsKeepTheirHue) {
  HeadMesh mesh = ball();  // its back is dark and brown, its front from 120 to 200
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    const bool is_back = mesh.positions[3 * i + 1] > 0.3f;
    const float front = 160 + 40 * mesh.positions[3 * i];
    const float colours[3] = {is_back ? 60 : front, is_back ? 48 : front, is_back ? 36 : front};
    std::copy(colours, colours + 3, &mesh.colours[3 * i]);
  }
  // Half the contrast: 80 + own / 2, in green alone.
  TexturePhoto photo = photo_from(kFront, {0, 0, 0});
  for (size_t i = 0; i < 200 * 200; ++i) {
    const double x = (double(i % 200) - 99.5) / 400 * 5.1, own = std::clamp(160 + 40 * x, 120.0, 200.0);
    photo.rgb[3 * i] = photo.rgb[3 * i + 2] = uint8_t(own), photo.rgb[3 * i + 1] = uint8_t(80 + own / 2);
  }
  const Rgb back = at(bake(mesh, {photo}), maq::normalized({0, 1, 0.2}));
  EXPECT_GT(back[0], back[1]) << "the line through the bright colours makes it green";
  EXPECT_GT(back[1], back[2]);
}

TEST(TextureBake, ADarkCollarIsNotPaintedOnTheNeck) {
  const HeadMesh mesh = mesh_of(  // a ball on a neck
      [](float x, float y, float z) { return std::min(std::hypot(x, y, z) - 1, std::hypot(x, y) - 0.6f); }, 1.3f);
  TexturePhoto photo = photo_from(kFront, {150, 120, 100});
  std::fill(photo.rgb.begin() + size_t(200) * 3 * 176, photo.rgb.end(), uint8_t(10));
  const TextureImage image = bake(mesh, {photo});
  int darkest = 255;
  for (int i = -20; i <= 20; ++i)
    darkest = std::min(darkest, at(image, {0.5 * std::sin(0.05 * i), -0.6 * std::cos(0.05 * i), -1.2})[0]);
  EXPECT_GT(darkest, 100);
}

TEST(TextureBake, WithoutPhotosAndOutsideTheMatteItIsTheMeshs) {
  for (const auto& photos : {std::vector<TexturePhoto>{}, {photo_from(kFront, {250, 0, 0}, 0.5f)}}) {
    const TextureImage image = bake(ball(), photos);
    EXPECT_EQ(image.photo_fraction, 0);
    for (const uint8_t value : image.bgr) ASSERT_EQ(value, kOwn);
  }
}

TEST(TextureBake, WhatIsNotSeenLooksAsItDidBefore) {
  TextureImage before;  // of half the size: 30 on one side, 200 on the other
  before.side_px = kSide / 2;
  for (int i = 0; i < before.side_px * before.side_px; ++i)
    before.bgr.insert(before.bgr.end(), 3, i % before.side_px < before.side_px / 2 ? 30 : 200);
  maq::WorkerThreads threads(1);
  const HeadMesh mesh = ball();
  const TextureOptions options{kSide};
  const TextureImage same = bake_texture(mesh, {}, options, threads, before);
  const Vec3 left = {0.8, -0.6, 0}, right = {-0.8, -0.6, 0};
  EXPECT_EQ(at(same, left)[0] + at(same, right)[0], 230);
  EXPECT_EQ(at(bake(mesh, {}), left)[0], kOwn);
  const TextureImage seen = bake_texture(mesh, {photo_from({0.8, -0.6, 0}, {90, 90, 90})}, options, threads, before);
  EXPECT_NEAR(at(seen, left)[0], 90, 2);
}

TEST(TextureBake, WhatLiesBehindAnotherPartTakesNothingOfIt) {
  // A small ball before the large one; the photo shows it in red.
  HeadMesh mesh = mesh_of([](float x, float y, float z) {
    return std::min(std::hypot(x, y, z) - 1, std::hypot(x - 0.3f, y + 1.6f, z) - 0.25f);
  });
  TexturePhoto photo = photo_from(kFront, {kOwn, kOwn, kOwn});
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      // Its middle is 4.4 dm away: (0.3, 0) / 4.4 * 400 to the right.
      if (std::hypot(x - 99.5 - 27.3, y - 99.5) < 22.9) photo.rgb[size_t(y * 200 + x) * 3] = 255;
    }
  }
  // All of the small ball at one place of the texture, where it is no area.
  for (size_t i = 0; i < mesh.vertex_count(); ++i) {
    if (std::hypot(mesh.positions[3 * i], mesh.positions[3 * i + 1], mesh.positions[3 * i + 2]) < 1.1f) continue;
    mesh.texture_coordinates[2 * i] = mesh.texture_coordinates[2 * i + 1] = 0.001f;
  }
  const TextureImage image = bake(mesh, {photo});
  EXPECT_GT(image.photo_fraction, 0.1);
  for (size_t i = 0; i < image.bgr.size(); ++i) ASSERT_NEAR(image.bgr[i], kOwn, 30) << "at " << i;
}

TEST(TextureBake, TheLightFromOneSideIsTakenOutWhereThatIsAskedFor) {
  HeadMesh mesh = ball();
  mesh.colours.assign(mesh.positions.size(), 180);
  // A ball of grey 150 with a dark band, in light that is twice as strong from the person's left as from the right.
  TexturePhoto photo = photo_from(kFront, {0, 0, 0});
  const auto own = [](double z) { return std::abs(z - 0.3) < 0.08 ? 60.0 : 150.0; };
  for (int row = 0; row < 200; ++row) {
    for (int column = 0; column < 200; ++column) {
      // Orthographic, nearly: the ball is 66 pixels wide to each side.
      const double x = (column - 99.5) / 66.7, z = (99.5 - row) / 66.7;
      for (size_t c = 0; c < 3; ++c) {
        photo.rgb[size_t(row * 200 + column) * 3 + c] = uint8_t(own(z) * std::clamp(1 + x / 3, 0.5, 1.5));
      }
    }
  }
  const TextureImage lit = bake(mesh, {photo}), even = bake(mesh, {photo}, 1, true);
  const auto slanted = [](double x, double z) { return Vec3{x, -std::sqrt(1 - x * x - z * z), z}; };
  const auto difference = [&](const TextureImage& image) {
    return at(image, slanted(0.5, 0))[1] - at(image, slanted(-0.5, 0))[1];
  };
  EXPECT_GT(difference(lit), 40) << "the photo's";
  EXPECT_LT(std::abs(difference(even)), 0.35 * difference(lit));
  EXPECT_NEAR(at(even, kFront)[1], at(lit, kFront)[1], 8) << "as bright as before";
  EXPECT_LT(at(even, slanted(0, 0.3))[1], 85) << "the band is the surface's own";
  EXPECT_LT(std::abs(at(even, kLeft)[1] - at(even, kRight)[1]), 0.5 * std::abs(at(lit, kLeft)[1] - at(lit, kRight)[1]))
      << "also where the photo does not see it";
}

TEST(TextureBake, AMirroredSideLooksAsTheOther) {
  const HeadMesh mesh = ball();
  // A mole in the middle of what the photo sees.
  TexturePhoto photo = photo_from(kLeft, {150, 120, 40});
  for (int y = 94; y < 106; ++y) std::fill_n(&photo.rgb[size_t(y * 200 + 94) * 3], 36, uint8_t(0));
  const TextureImage mirrored = bake(mesh, {photo});
  expect_near(at(mirrored, kLeft), {0, 0, 0}, 2);
  expect_near(at(mirrored, kRight), {0, 0, 0}, 6);  // in the light of its side
}

TEST(TextureBake, PhotosOfOtherExposureMeetWithoutAStep) {
  const TextureImage image = bake(ball(), {photo_from(kLeft, {180, 180, 180}), photo_from(kFront, {120, 120, 120})});
  EXPECT_LE(largest_step(image), 8) << "of 60";
  const int left = at(image, kLeft)[0], front = at(image, kFront)[0];
  EXPECT_NEAR(left, front, 10) << "both have the mean level";
  EXPECT_NEAR(left, 150, 15);
}

TEST(TextureBake, IsTheSameForAnyNumberOfThreadsAndChecksItsSide) {
  const HeadMesh mesh = ball();
  const std::vector<TexturePhoto> photos = {photo_from(kFront, {200, 120, 40}), photo_from(kLeft, {10, 20, 30})};
  EXPECT_EQ(bake(mesh, photos, 1).bgr, bake(mesh, photos, 3).bgr);
  maq::WorkerThreads threads(1);
  for (const int side : {0, 255, 2049, -1}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "pixels a side", [&] { bake_texture(mesh, {}, {side}, threads); });
  }
}

TEST(TextureBake, ACropsCameraSeesWhereTheCropShowsIt) {
  HeadCamera camera = photo_from(maq::normalized({0.3, -1, 0}), {0, 0, 0}).camera;
  camera.cx_px = 310, camera.cy_px = 250;
  maq::AffineMap to_crop;
  const double scale = 0.7, turn = 0.4;
  to_crop.xx = scale * std::cos(turn), to_crop.xy = -scale * std::sin(turn);
  to_crop.yx = -to_crop.xy, to_crop.yy = to_crop.xx;
  to_crop.shift_x = -20, to_crop.shift_y = 35;
  const HeadCamera crop = crop_camera(camera, to_crop, 128);
  EXPECT_EQ(crop.width_px, 128);
  const auto pixel = [](const HeadCamera& by, Vec3 p) {
    const Vec3 seen = by.head_to_camera * p;
    return maq::Point{by.focal_px * seen.x / seen.z + by.cx_px, by.focal_px * seen.y / seen.z + by.cy_px};
  };
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{0.5, -0.8, 0.3}, Vec3{-0.9, 0.2, -1}}) {
    const maq::Point in_photo = pixel(camera, p), in_crop = pixel(crop, p);
    const maq::Point expected = to_crop({in_photo.x + 0.5, in_photo.y + 0.5});
    EXPECT_NEAR(in_crop.x + 0.5, expected.x, 1e-9);
    EXPECT_NEAR(in_crop.y + 0.5, expected.y, 1e-9);
  }
}

TEST(TextureBake, FillingKeepsWhatIsKnownAndGoesOnFromIt) {
  constexpr int side = 37;
  std::vector<float> weights(side * side), values(3 * side * side, 777);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      if (x >= 8 && x < 28) continue;  // a strip in the middle is not known
      weights[size_t(y * side + x)] = 1;
      for (int c = 0; c < 3; ++c) values[size_t(3 * (y * side + x) + c)] = x < 8 ? 10.0f : 50.0f;
    }
  }
  fill_smoothly(side, weights, values);
  for (int x = 0; x < side; ++x) {
    const float value = values[size_t(3 * (18 * side + x))];
    if (x < 8) {
      EXPECT_EQ(value, 10);
    }
    if (x >= 28) {
      EXPECT_EQ(value, 50);
    }
    EXPECT_GE(value, 9.99f);
    EXPECT_LE(value, 50.01f);
  }
  EXPECT_LT(values[size_t(3 * (18 * side + 9))], 20);
  EXPECT_GT(values[size_t(3 * (18 * side + 26))], 40);
  const auto distances = distance_to_known(side, weights);
  EXPECT_EQ(distances[size_t(18 * side + 3)], 0);
  EXPECT_EQ(distances[size_t(18 * side + 12)], 5);
  EXPECT_EQ(distance_to_known(2, {0, 0, 0, 0})[0], 1e9f);
}

}  // namespace
}  // namespace texture_bake_tests
