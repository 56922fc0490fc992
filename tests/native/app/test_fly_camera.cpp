// Where the camera of a flight begins, what steering does to it, flights to photos, poses at the edge of numbers.
#include <app/fly_camera.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace {

using Vec3 = std::array<double, 3>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegree = 3.14159265358979323846 / 180;

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec3 scaled(const Vec3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
Vec3 sum(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vec3 unit(const Vec3& a) { return scaled(a, 1 / std::sqrt(dot(a, a))); }
Vec3 row(const maq_pinhole_camera& camera, int index) {
  const double* const r = camera.rotation + 3 * index;
  return {r[0], r[1], r[2]};
}
Vec3 position(const maq_pinhole_camera& camera) { return {camera.centre[0], camera.centre[1], camera.centre[2]}; }
double distance(const Vec3& a, const Vec3& b) {
  const Vec3 d = sum(a, scaled(b, -1));
  return std::sqrt(dot(d, d));
}

maq_scene_info scene(const Vec3& up = {0, 0, 1}, const Vec3& low = {-1, -2, -3}, const Vec3& high = {1, 2, 3}) {
  maq_scene_info info{};
  for (size_t i = 0; i < 3; ++i) info.up[i] = up[i], info.bounds_min[i] = low[i], info.bounds_max[i] = high[i];
  return info;
}

// Faces along `forward`; the right is level for an upright camera, then rotated about `forward` by `roll`.
maq_pinhole_camera photo(const Vec3& at, const Vec3& forward, double roll = 0, const Vec3& up = {0, 0, 1}) {
  maq_pinhole_camera camera{};
  camera.struct_size = sizeof camera;
  camera.intrinsics.width_px = 640;
  camera.intrinsics.height_px = 480;
  camera.intrinsics.fx_px = 431;
  camera.intrinsics.fy_px = 433;
  camera.intrinsics.cx_px = 310;
  camera.intrinsics.cy_px = 250;
  const Vec3 f = unit(forward);
  Vec3 right = cross(f, up);
  if (dot(right, right) < 1e-12) right = cross(f, {f[1], f[2], f[0]});
  right = unit(right);
  const Vec3 down = cross(f, right);
  const Vec3 x = sum(scaled(right, std::cos(roll)), scaled(down, std::sin(roll)));
  const Vec3 rows[3] = {x, cross(f, x), f};
  for (int i = 0; i < 9; ++i) camera.rotation[i] = rows[i / 3][size_t(i % 3)];
  for (size_t i = 0; i < 3; ++i) camera.centre[i] = at[i];
  return camera;
}

void expect_rotation(const maq_pinhole_camera& camera, const std::string& when = "") {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(dot(row(camera, i), row(camera, j)), i == j, 1e-9) << when;
  }
  EXPECT_NEAR(dot(cross(row(camera, 0), row(camera, 1)), row(camera, 2)), 1, 1e-9) << when;
  for (const double number : camera.centre) EXPECT_TRUE(std::isfinite(number)) << when;
  EXPECT_TRUE(std::isfinite(camera.intrinsics.fx_px) && camera.intrinsics.fx_px > 0 &&
              std::isfinite(camera.intrinsics.fy_px) && camera.intrinsics.fy_px > 0);
}

void expect_same(const maq_pinhole_camera& a, const maq_pinhole_camera& b, double tolerance = 0) {
  EXPECT_EQ(a.intrinsics.width_px, b.intrinsics.width_px);
  EXPECT_EQ(a.intrinsics.height_px, b.intrinsics.height_px);
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(a.rotation[i], b.rotation[i], tolerance) << i;
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a.centre[i], b.centre[i], tolerance) << i;
  EXPECT_NEAR(a.intrinsics.fx_px, b.intrinsics.fx_px, tolerance);
  EXPECT_NEAR(a.intrinsics.fy_px, b.intrinsics.fy_px, tolerance);
  EXPECT_NEAR(a.intrinsics.cx_px, b.intrinsics.cx_px, tolerance);
  EXPECT_NEAR(a.intrinsics.cy_px, b.intrinsics.cy_px, tolerance);
}

// Where a point of the world lies in the image; the third number is its depth.
Vec3 seen(const maq_pinhole_camera& camera, const Vec3& point) {
  const Vec3 away = sum(point, scaled(position(camera), -1));
  const double x = dot(row(camera, 0), away), y = dot(row(camera, 1), away), z = dot(row(camera, 2), away);
  return {camera.intrinsics.fx_px * x / z + camera.intrinsics.cx_px,
          camera.intrinsics.fy_px * y / z + camera.intrinsics.cy_px, z};
}

double pitch_of(const maq_pinhole_camera& camera, const Vec3& up) {
  return std::asin(std::clamp(dot(row(camera, 2), up), -1.0, 1.0));
}

TEST(FlyCamera, BeginsAtTheMiddlePhotoExactly) {
  const std::vector<maq_pinhole_camera> photos{photo({0, 0, 0}, {1, 0, 0}), photo({1, 2, 3}, {0, 1, 0.2}, 0.3),
                                               photo({4, 0, 0}, {1, 0, 0})};
  const maquette::FlyCamera fly(scene(), photos);
  expect_same(fly.camera(640, 480), photos[1]);
  EXPECT_EQ(fly.photo_index(), 1);
  ASSERT_TRUE(fly.photo_camera().has_value());
  expect_same(*fly.photo_camera(), photos[1]);
}

TEST(FlyCamera, WithoutPhotosItSeesTheWholeBoxFromOutsideUpright) {
  for (const Vec3& up : {Vec3{0, 0, 1}, Vec3{1, 0, 0}, unit({1, -2, 0.5}), Vec3{0, -1, 0}}) {
    const maquette::FlyCamera fly(scene(up), {});
    EXPECT_EQ(fly.photo_index(), -1);
    EXPECT_FALSE(fly.photo_camera().has_value());
    for (const auto& [width, height] : {std::pair<int, int>{640, 480}, {300, 900}, {1000, 200}}) {
      const maq_pinhole_camera camera = fly.camera(width, height);
      expect_rotation(camera);
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 pixel = seen(camera, {corner & 1 ? 1.0 : -1, corner & 2 ? 2.0 : -2, corner & 4 ? 3.0 : -3});
        EXPECT_GT(pixel[2], 0);
        EXPECT_TRUE(pixel[0] > 0 && pixel[0] < width && pixel[1] > 0 && pixel[1] < height)
            << pixel[0] << " " << pixel[1];
      }
      EXPECT_NEAR(dot(row(camera, 0), up), 0, 1e-9) << "it is level";
      EXPECT_LT(dot(row(camera, 1), up), -0.5) << "the world's up is up in the picture";
      EXPECT_LT(dot(row(camera, 2), up), 0) << "from above";
    }
  }
}

TEST(FlyCamera, MovesByItsOwnAxesAndTheWorldsUp) {
  const maq_pinhole_camera start = photo({1, 2, 3}, {1, 1, -0.5});
  maquette::FlyCamera fly(scene(), {start});
  const double diagonal = std::sqrt(4.0 + 16 + 36);
  fly.move(1, 0, 0, 2, 0.1);
  Vec3 expected = sum(position(start), scaled(row(start, 0), 0.2 * diagonal));
  EXPECT_NEAR(distance(position(fly.camera(64, 48)), expected), 0, 1e-12);
  EXPECT_EQ(fly.photo_index(), -1) << "it has left the photo";
  EXPECT_FALSE(fly.photo_camera().has_value());
  fly.move(0, -0.5, 7, 1, 0.1);
  expected = sum(expected, sum(scaled({0, 0, 1}, -0.05 * diagonal), scaled(row(start, 2), 0.1 * diagonal)));
  EXPECT_NEAR(distance(position(fly.camera(64, 48)), expected), 0, 1e-12) << "no faster than 1";
}

TEST(FlyCamera, TurnsRightAboutTheWorldsUpAndUpwards) {
  for (const Vec3& up : {Vec3{0, 0, 1}, unit({0.3, -1, 0.2})}) {
    const maquette::FlyCamera start(scene(up), {});
    const maq_pinhole_camera before = start.camera(64, 48);
    maquette::FlyCamera fly = start;
    fly.rotate(0.2, 0);
    maq_pinhole_camera after = fly.camera(64, 48);
    EXPECT_GT(dot(row(after, 2), row(before, 0)), 0.1) << "to the right";
    EXPECT_NEAR(pitch_of(after, up), pitch_of(before, up), 1e-12);
    fly = start;
    fly.rotate(0, 0.2);
    after = fly.camera(64, 48);
    EXPECT_NEAR(pitch_of(after, up), pitch_of(before, up) + 0.2, 1e-12);
    EXPECT_NEAR(dot(row(after, 0), row(before, 0)), 1, 1e-12) << "upwards alone";
    fly.rotate(2, 0.3);
    fly.rotate(-2, -0.5);
    expect_same(fly.camera(64, 48), before, 1e-12);
  }
}

TEST(FlyCamera, NeverFlipsOver) {
  for (const Vec3& up : {Vec3{0, 0, 1}, Vec3{0, -1, 0}, unit({1, 1, 1}), unit({-3, 0.1, 0.2})}) {
    for (const double pitch : {10.0, 1e6, -10.0, -1e300}) {
      maquette::FlyCamera fly(scene(up), {});
      for (int i = 0; i < 5; ++i) {
        fly.rotate(0.4, pitch);
        const maq_pinhole_camera camera = fly.camera(64, 48);
        expect_rotation(camera);
        EXPECT_NEAR(pitch_of(camera, up), std::copysign(89 * kDegree, pitch), 1e-6);
        EXPECT_LT(dot(row(camera, 1), up), 0) << "the world's up is up in the picture";
        EXPECT_NEAR(dot(row(camera, 0), up), 0, 1e-9) << "it is level";
      }
      fly.rotate(0, -std::copysign(89 * kDegree, pitch));
      EXPECT_NEAR(pitch_of(fly.camera(64, 48), up), 0, 1e-9) << "back at once";
    }
  }
}

TEST(FlyCamera, ALeaningCameraTurnsWithoutAJumpAndGetsUpright) {
  for (const double roll : {0.5, -1.5, 3.0, 3.14159265358979}) {
    const maq_pinhole_camera start = photo({1, 2, 3}, {1, 1, -0.5}, roll);
    maquette::FlyCamera fly(scene(), {start});
    fly.rotate(1e-6, -1e-6);
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(fly.camera(640, 480).rotation[i], start.rotation[i], 1e-5);
    double rolled = std::abs(roll);
    for (int i = 0; i < 200; ++i) {
      fly.rotate(0.05, i % 2 == 0 ? 0.02 : -0.02);
      const maq_pinhole_camera camera = fly.camera(640, 480);
      expect_rotation(camera);
      const Vec3 level = unit(cross(row(camera, 2), {0, 0, 1}));
      const double now = std::acos(std::clamp(dot(row(camera, 0), level), -1.0, 1.0));
      EXPECT_LT(now, rolled + 1e-6);
      rolled = now;
    }
    EXPECT_LT(rolled, 1e-3);
  }
}

TEST(FlyCamera, FromStraightUpOrDownItTurnsTheWayThePictureDoes) {
  for (const double forward : {1.0, -1.0}) {
    for (const double roll : {0.0, 0.7, 2.5}) {
      const maq_pinhole_camera start = photo({0, 0, 0}, {1e-17, 0, forward}, roll);
      maquette::FlyCamera fly(scene(), {start});
      expect_same(fly.camera(640, 480), start);
      fly.rotate(0, -forward * 0.5);
      const maq_pinhole_camera camera = fly.camera(640, 480);
      expect_rotation(camera);
      // From straight down upwards goes to the image's upper edge, from straight up downwards to its lower one.
      EXPECT_NEAR(dot(row(camera, 2), row(start, 1)), forward * std::sin(0.5), 1e-6);
      EXPECT_NEAR(dot(row(camera, 0), row(start, 0)), 1, 1e-6);
    }
  }
}

TEST(FlyCamera, ZoomsBetween20And110Degrees) {
  maquette::FlyCamera fly(scene(), {});
  const auto degrees = [&] { return 2 * std::atan(320 / fly.camera(640, 480).intrinsics.fx_px) / kDegree; };
  const double before = degrees();
  fly.zoom(1.1);
  EXPECT_LT(degrees(), before);
  for (int i = 0; i < 100; ++i) fly.zoom(1.1);
  EXPECT_NEAR(degrees(), 20, 1e-9);
  for (int i = 0; i < 100; ++i) fly.zoom(0.9);
  EXPECT_NEAR(degrees(), 110, 1e-9);
  for (const double wrong : {0.0, -1.0, kNan, kInfinity}) fly.zoom(wrong);
  EXPECT_NEAR(degrees(), 110, 1e-9);
  fly.zoom(1e300);
  EXPECT_NEAR(degrees(), 20, 1e-9);
}

TEST(FlyCamera, AnyPictureShowsAllOfThePhoto) {
  const maq_pinhole_camera start = photo({1, 2, 3}, {1, 1, -0.5}, 0.2);
  const maquette::FlyCamera fly(scene(), {start});
  for (const auto& [width, height] : {std::pair<int, int>{1280, 960}, {1000, 480}, {320, 700}}) {
    const maq_pinhole_camera camera = fly.camera(width, height);
    const double scale = std::min(width / 640.0, height / 480.0);
    const Vec3 point = sum(position(start), sum(row(start, 2), scaled(row(start, 0), 0.3)));
    const Vec3 there = seen(start, point), here = seen(camera, point);
    EXPECT_NEAR(here[0] - 0.5 * (width - 1), scale * (there[0] - 319.5), 1e-9);
    EXPECT_NEAR(here[1] - 0.5 * (height - 1), scale * (there[1] - 239.5), 1e-9);
  }
}

TEST(FlyCamera, FliesSmoothlyAndEndsExactlyAtThePhoto) {
  maq_pinhole_camera target = photo({4, -2, 1}, {-1, 0.3, 0.1}, -0.4);
  target.intrinsics.width_px = 480, target.intrinsics.height_px = 640, target.intrinsics.fx_px = 900,
  target.intrinsics.cx_px = 200;
  maquette::FlyCamera fly(scene(), {photo({1, 2, 3}, {1, 1, -0.5}, 0.2)});
  const maq_pinhole_camera start = fly.camera(800, 600);
  fly.fly_to(target, 2, 7);
  expect_same(fly.camera(800, 600), start, 1e-9);
  EXPECT_EQ(fly.photo_index(), -1);
  maq_pinhole_camera before = start;
  double way = 0, longest = 0, turned = 0;
  int steps = 0;
  while (fly.update(0.01)) {
    const maq_pinhole_camera now = fly.camera(800, 600);
    expect_rotation(now);
    const double step = distance(position(before), position(now));
    way += step, longest = std::max(longest, step);
    turned += std::acos(std::min(1.0, dot(row(before, 2), row(now, 2))));
    EXPECT_LT(std::abs(now.intrinsics.fx_px - before.intrinsics.fx_px), 20);
    EXPECT_LT(std::acos(std::min(1.0, dot(row(before, 0), row(now, 0)))), 0.05);
    before = now;
    ASSERT_LE(++steps, 202);
  }
  EXPECT_GE(steps, 199);
  EXPECT_NEAR(way, distance(position(start), position(target)), 1e-9) << "straight";
  EXPECT_LT(longest, 1.6 * way / 200) << "no step is much longer than the mean";
  EXPECT_LT(turned, 3.2);
  expect_same(fly.camera(480, 640), target);
  EXPECT_EQ(fly.photo_index(), 7);
  expect_same(*fly.photo_camera(), target);
}

TEST(FlyCamera, SteeringEndsAFlight) {
  const std::vector<maq_pinhole_camera> photos{photo({1, 2, 3}, {1, 1, -0.5}), photo({4, -2, 1}, {-1, 0.3, 0.1})};
  for (int way = 0; way < 3; ++way) {
    maquette::FlyCamera fly(scene(), photos);
    fly.fly_to(photos[0], 1, 0);
    fly.update(0.5);
    const maq_pinhole_camera half = fly.camera(800, 600);
    if (way == 0) fly.move(1e-9, 0, 0, 1, 0.1);
    if (way == 1) fly.rotate(1e-9, 0);
    if (way == 2) fly.zoom(1 + 1e-9);
    EXPECT_FALSE(fly.update(1));
    expect_same(fly.camera(800, 600), half, 1e-5);
    EXPECT_EQ(fly.photo_index(), -1);
  }
}

TEST(FlyCamera, FindsTheNearestPhotoByPlaceAndDirection) {
  const std::vector<maq_pinhole_camera> photos{photo({0, 0, 0}, {1, 0, 0}), photo({0.1, 0, 0}, {-1, 0, 0}),
                                               photo({3, 0, 0}, {1, 0, 0})};
  maquette::FlyCamera fly(scene(), {photo({0.12, 0, 0}, {1, 0.1, 0})});
  EXPECT_EQ(fly.nearest_photo(photos), 0) << "1 is nearer, but looks the other way";
  fly.rotate(3, 0);
  EXPECT_EQ(fly.nearest_photo(photos), 1);
  fly.fly_to(photos[2], 0, 2);
  EXPECT_EQ(fly.nearest_photo(photos), 2);
  EXPECT_EQ(fly.nearest_photo({}), -1);
}

TEST(FlyCamera, WhatIsNotFiniteOrNoCameraDoesNothing) {
  maquette::FlyCamera fly(scene(), {photo({1, 2, 3}, {1, 1, -0.5})});
  for (const double wrong : {kNan, kInfinity, -kInfinity}) {
    fly.move(wrong, 0, 0, kNan, 0.1);
    fly.move(1, 0, 0, wrong, 0.1);
    fly.move(1, 0, 0, 1, wrong);
    fly.rotate(wrong, 0);
    fly.rotate(0, wrong);
    EXPECT_FALSE(fly.update(wrong));
  }
  fly.move(kNan, 0, 0, 1, 0.1);
  fly.move(0, kNan, 1, 1, 0.1);
  const auto expect_ignored = [&](auto change) {
    maq_pinhole_camera camera = photo({4, -2, 1}, {-1, 0.3, 0.1});
    change(camera);
    fly.fly_to(camera, 0, 0);
    EXPECT_EQ(fly.camera(640, 480).centre[0], 1);
  };
  expect_ignored([](maq_pinhole_camera& camera) { camera.rotation[4] = kNan; });
  expect_ignored([](maq_pinhole_camera& camera) { camera.rotation[4] += 0.2; });
  expect_ignored([](maq_pinhole_camera& camera) {
    for (double& number : camera.rotation) number = 0;
  });
  expect_ignored([](maq_pinhole_camera& camera) {
    for (double& number : camera.rotation) number = -number;
  });
  expect_ignored([](maq_pinhole_camera& camera) { camera.centre[2] = kInfinity; });
  expect_ignored([](maq_pinhole_camera& camera) { camera.intrinsics.width_px = 0; });
  expect_ignored([](maq_pinhole_camera& camera) { camera.intrinsics.fy_px = -1; });
  expect_ignored([](maq_pinhole_camera& camera) { camera.intrinsics.fx_px = kNan; });
  expect_ignored([](maq_pinhole_camera& camera) { camera.intrinsics.cx_px = kInfinity; });
  fly.fly_to(photo({4, -2, 1}, {-1, 0.3, 0.1}), kNan, 0);
  EXPECT_EQ(fly.photo_index(), 0) << "it never left";
  expect_rotation(
      maquette::FlyCamera(scene({kNan, 0, 0}, {kInfinity, 0, 0}, {0, 0, kNan}), {maq_pinhole_camera{}}).camera(64, 48));
  expect_rotation(maquette::FlyCamera(scene({0, 0, 0}), {}).camera(64, 48));
}

TEST(FlyCamera, ARotationThatIsATrifleOffIsMadeOne) {
  maq_pinhole_camera target = photo({4, -2, 1}, {-1, 0.3, 0.1});
  for (double& number : target.rotation) number *= 1.0005;
  maquette::FlyCamera fly(scene(), {});
  fly.fly_to(target, 0, 0);
  EXPECT_EQ(fly.photo_index(), 0);
  expect_rotation(fly.camera(640, 480));
}

}  // namespace
