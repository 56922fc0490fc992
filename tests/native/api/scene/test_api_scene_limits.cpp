// As many points as nobody should have, through the C API: memory stays bounded.
#include <gtest/gtest.h>

#include "support/peak_memory.h"
#include "support/samples/api_tiny_scene.h"

namespace {

using namespace api_tiny_scene;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr size_t kPoints = 200'000;
#else
constexpr size_t kPoints = 20'000'000;
#endif

TEST(ApiSceneLimits, TwentyMillionPointsOfAnAppTakeLittleMoreThanACopyOfThem) {
  std::vector<float> places = ball(2000);
  // The others are farther away, behind the ball and beside it.
  places.reserve(3 * kPoints);
  for (size_t i = places.size() / 3; i < kPoints; ++i) {
    for (const float value : {-5.0f, 10 * float(i % 4001) / 4001 - 5, 10 * float(i % 4999) / 4999 - 5}) {
      places.push_back(value);
    }
  }
  const maquette::Context context;
  const Photo photo;
  const double grown_mib = peak_memory_growth_mib([&] {
    maquette::SceneBuilder builder(context, build_config(), cloud_of(places));
    EXPECT_GT(builder.add_view(maquette::Frame(context, photo.desc), camera_at(0)), 300u);
    const maquette::Scene scene = builder.finish();
    EXPECT_EQ(builder.stats().cloud_point_count, kPoints);
    EXPECT_LT(scene.info().point_count, 5000u);
    maquette::SceneRenderer renderer(context, renderer_config(), scene);
    EXPECT_GT(renderer.run(camera_at(0.1)).scene_stats().shaded_point_count, 300u);
  });
  RecordProperty("grown_mib", std::to_string(grown_mib));
  // 229 MiB for the copy, 76 for what is known of points that nobody saw.
  EXPECT_LT(grown_mib, 400);
}

TEST(ApiSceneLimits, MostPointsThinsThemOut) {
  const std::vector<float> places = ball(100'000);
  const maquette::Context context;
  maq_scene_build_config config = build_config();
  config.max_points = 999;
  maquette::SceneBuilder builder(context, config, cloud_of(places));
  EXPECT_EQ(builder.stats().cloud_point_count, 999u);
  const Photo photo;
  for (const double angle : {0.0, 2.1, 4.2}) {
    builder.add_view(maquette::Frame(context, photo.desc), camera_at(angle));
  }
  const maq_scene_info info = builder.finish().info();
  EXPECT_LE(info.point_count, 999u);
  EXPECT_LT(info.bounds_min[2], -0.8) << "evenly: from all of the ball";
  EXPECT_GT(info.bounds_max[2], 0.8);
}

}  // namespace
