// The surface that labels mean, of the shipped bundle and of bundles without a sound one.
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "support/picture_files.h"
#include "support/samples/bundle_copy.h"

namespace {

constexpr char kShipped[] = MAQ_TEST_MODELS "/densepose-b-int8";

struct Point {
  double x_m = 0, y_m = 0, z_m = 0;
};

// The middle of what a part reaches; parts count from 1.
Point middle_of(const maq_densepose_surface& surface, int part) {
  const size_t nodes = size_t(surface.nodes) * size_t(surface.nodes);
  Point sum;
  double count = 0;
  for (size_t node = 0; node < nodes; ++node) {
    const float* point = surface.points_m + (size_t(part - 1) * nodes + node) * 3;
    if (std::isnan(point[0])) continue;
    sum = {sum.x_m + double(point[0]), sum.y_m + double(point[1]), sum.z_m + double(point[2])};
    ++count;
  }
  return {sum.x_m / count, sum.y_m / count, sum.z_m / count};
}

TEST(ApiSurface, OfTheShippedBundleIsABody) {
  const maquette::Context context;
  const maquette::DensePose densepose(context, kShipped);
  const auto surface = densepose.surface();
  ASSERT_TRUE(surface);
  ASSERT_EQ(surface->nodes, 25);
  float low[3] = {9, 9, 9}, high[3] = {-9, -9, -9};
  int unreached = 0;
  for (size_t i = 0; i < 24 * 25 * 25; ++i) {
    const float* point = surface->points_m + 3 * i;
    ASSERT_TRUE(std::isnan(point[0]) == std::isnan(point[1]) && std::isnan(point[0]) == std::isnan(point[2])) << i;
    unreached += std::isnan(point[0]);
    for (size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::fmin(low[axis], point[axis]);
      high[axis] = std::fmax(high[axis], point[axis]);
    }
  }
  EXPECT_GT(unreached, 100);
  EXPECT_LT(unreached, 24 * 25 * 25 / 2);
  EXPECT_GT(high[2] - low[2], 1.4) << "from head to foot";
  EXPECT_LT(high[2] - low[2], 2.1);
  EXPECT_GT(high[0] - low[0], high[1] - low[1]) << "broader than deep";
  // Parts in DensePose's numbering.
  const Point back = middle_of(*surface, 1), front = middle_of(*surface, 2), right_hand = middle_of(*surface, 3),
              left_hand = middle_of(*surface, 4), left_foot = middle_of(*surface, 5), head = middle_of(*surface, 23);
  EXPECT_GT(head.z_m, front.z_m);
  EXPECT_GT(front.z_m, left_foot.z_m + 0.5);
  EXPECT_GT(back.y_m, front.y_m) << "y goes to the back";
  EXPECT_GT(left_hand.x_m, right_hand.x_m + 0.3) << "x goes to the body's left";
}

// The place of one node, from the file's bytes (docs/reference/formats.md).
TEST(ApiSurface, PointsAreThoseOfTheFile) {
  const maquette::Context context;
  const maquette::DensePose densepose(context, kShipped);
  const auto surface = densepose.surface();
  ASSERT_TRUE(surface);
  const std::string file = read_text(std::string(kShipped) + "/surface.grid");
  const auto stored = [&](size_t value) {
    return int(uint8_t(file[40 + 2 * value])) + 256 * int(uint8_t(file[41 + 2 * value]));
  };
  for (const size_t node : {size_t(0), size_t(7 * 625 + 12 * 25 + 3), size_t(24 * 625 - 1)}) {
    for (size_t axis = 0; axis < 3; ++axis) {
      float low = 0, high = 0;
      std::memcpy(&low, &file[16 + 4 * axis], 4);
      std::memcpy(&high, &file[28 + 4 * axis], 4);
      const int value = stored(3 * node + axis);
      const float found = surface->points_m[3 * node + axis];
      if (value == 65535) {
        EXPECT_TRUE(std::isnan(found));
      } else {
        EXPECT_NEAR(found, low + float(value) / 65534 * (high - low), 1e-5) << node;
      }
    }
  }
}

TEST(ApiSurface, IsTheSameForEveryThreadAndCall) {
  const maquette::Context context;
  const maquette::DensePose densepose(context, kShipped);
  const float* found[4] = {};
  std::vector<std::thread> threads;
  for (const float*& points : found) threads.emplace_back([&] { points = densepose.surface()->points_m; });
  for (std::thread& thread : threads) thread.join();
  EXPECT_NE(found[0], nullptr);
  for (const float* points : found) EXPECT_EQ(points, found[0]);
}

TEST(ApiSurface, ABundleWithoutOneSaysSo) {
  const maquette::Context context;
  const maquette::DensePose densepose(context, MAQ_TEST_DATA "/tiny_bundle");
  EXPECT_FALSE(densepose.surface());
  EXPECT_NE(std::string(maq_last_error(densepose.get())).find("no surface grid"), std::string::npos);
}

TEST(ApiSurface, StructsOfUnknownSizeAreRefused) {
  const maquette::Context context;
  const maquette::DensePose densepose(context, kShipped);
  for (const uint32_t wrong : {0u, 3u, 100000u}) {
    maq_densepose_surface surface{wrong, -1, nullptr};
    EXPECT_EQ(maq_densepose_get_surface(densepose.get(), &surface), MAQ_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(surface.nodes, -1);
  }
}

TEST(ApiSurface, ADamagedFileIsRefused) {
  const maquette::Context context;
  const BundleCopy bundle;
  std::filesystem::copy(std::string(kShipped) + "/surface.grid", bundle.file("surface.grid"));
  nlohmann::json manifest = bundle.manifest();
  manifest["surface"]["file"] = "surface.grid";
  bundle.write_manifest(manifest);
  EXPECT_EQ(status_of([&] { maquette::DensePose(context, bundle.path()); }), MAQ_ERROR_BAD_BUNDLE) << "not listed";
  manifest["files"]["surface.grid"] =
      nlohmann::json::parse(read_text(std::string(kShipped) + "/manifest.json"))["files"]["surface.grid"];
  bundle.write_manifest(manifest);
  EXPECT_TRUE(maquette::DensePose(context, bundle.path()).surface());
  bundle.flip_byte("surface.grid");
  EXPECT_EQ(status_of([&] { maquette::DensePose(context, bundle.path()); }), MAQ_ERROR_BAD_BUNDLE);
}

TEST(ApiSurface, AFileThatIsNoGridIsRefusedAtEachCall) {
  const maquette::Context context;
  const BundleCopy bundle;
  nlohmann::json manifest = bundle.manifest();
  manifest["surface"]["file"] = "charts.f32";
  bundle.write_manifest(manifest);
  const maquette::DensePose densepose(context, bundle.path());
  for (int call = 0; call < 2; ++call) {
    std::string text;
    EXPECT_EQ(status_of([&] { densepose.surface(); }, &text), MAQ_ERROR_BAD_BUNDLE);
    EXPECT_NE(text.find("charts.f32 is not a surface grid"), std::string::npos) << text;
  }
}

}  // namespace
