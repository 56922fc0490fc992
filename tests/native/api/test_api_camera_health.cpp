// Camera health through the C API: results and maps, names of events, statuses.
#include <gtest/gtest.h>

#include <maquette/maquette.hpp>
#include <string>
#include <vector>

namespace {

std::string health_problem() { return maq_last_error(nullptr); }

class ApiCameraHealth : public testing::Test {
 protected:
  const maquette::Context context_;
};

TEST_F(ApiCameraHealth, ResultsAndMapsOfAStream) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30&frames=20");
  maquette::CameraHealth health(context_);
  int frames = 0;
  while (const auto frame = source.next()) {
    const maq_camera_health_result result = health.push(*frame);
    EXPECT_EQ(result.is_stream_start, frames == 0 ? 1 : 0);
    EXPECT_EQ(result.event, MAQ_CAMERA_OK);
    EXPECT_EQ(result.state, MAQ_CAMERA_OK);
    const std::vector<float> map = health.map();
    EXPECT_EQ(map.size(), size_t(result.columns) * size_t(result.rows));
    EXPECT_GT(map.size(), 100u);
    size_t unexplained = 0;
    for (const float value : map) unexplained += value > 0.5f ? 1 : 0;
    EXPECT_NEAR(double(unexplained) / double(map.size()), double(result.unexplained), 1e-5);
    ++frames;
  }
  const maq_camera_health_stats stats = health.stats();
  EXPECT_EQ(stats.pushed_count, 20u);
  EXPECT_EQ(stats.event_count, 0u);
  EXPECT_EQ(stats.stream_start_count, 1u);
  EXPECT_GT(stats.push_ms, 0);
}

TEST_F(ApiCameraHealth, ACutIsAnEventThatBeganOneFrameBefore) {
  maquette::CameraHealth health(context_);
  maquette::Source one(context_, "stub:people?count=2&seed=3&size=320x240&fps=30");
  maquette::Source other(context_, "stub:pattern?size=320x240&fps=30");
  for (int i = 0; i < 15; ++i) EXPECT_EQ(health.push(*one.next()).event, MAQ_CAMERA_OK) << i;
  for (int i = 0; i < 15; ++i) other.next();
  const auto first = other.next();
  EXPECT_EQ(health.push(*first).event, MAQ_CAMERA_OK);
  const maq_camera_health_result result = health.push(*other.next());
  EXPECT_EQ(result.event, MAQ_CAMERA_CUT);
  EXPECT_EQ(result.state, MAQ_CAMERA_OK);
  EXPECT_EQ(result.began_ns, first->desc().timestamp_ns);
  EXPECT_EQ(health.stats().event_count, 1u);
  health.reset();
  EXPECT_EQ(health.push(*other.next()).is_stream_start, 1);
}

TEST_F(ApiCameraHealth, EveryEventHasAName) {
  EXPECT_STREQ(maq_camera_event_get_name(MAQ_CAMERA_OK), "ok");
  EXPECT_STREQ(maq_camera_event_get_name(MAQ_CAMERA_OBJECT), "object");
  for (const int wrong : {-1, 7, 1 << 30}) EXPECT_STREQ(maq_camera_event_get_name(maq_camera_event(wrong)), "unknown");
}

TEST_F(ApiCameraHealth, WhatIsWrongIsTold) {
  maquette::CameraHealth health(context_);
  const maquette::Frame frame = std::move(*maquette::Source(context_, "stub:pattern?size=64x48").next());
  maq_camera_health_result result{};
  EXPECT_EQ(maq_camera_health_push(health.get(), frame.get(), &result), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(health_problem().find("result.struct_size"), std::string::npos);
  EXPECT_EQ(health.stats().pushed_count, 0u) << "refused before the frame was seen";
  result.struct_size = sizeof result;
  EXPECT_EQ(maq_camera_health_push(health.get(), nullptr, &result), MAQ_ERROR_INVALID_ARGUMENT);
  std::vector<float> values(1000);
  EXPECT_EQ(maq_camera_health_copy_map(health.get(), values.data(), values.size()), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(health_problem().find("No frame was pushed"), std::string::npos);
  EXPECT_EQ(maq_camera_health_push(health.get(), frame.get(), &result), MAQ_OK);
  const size_t cells = size_t(result.columns) * size_t(result.rows);
  EXPECT_EQ(maq_camera_health_copy_map(health.get(), values.data(), cells - 1), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(health_problem().find("but the map has " + std::to_string(cells) + " cells"), std::string::npos);
  EXPECT_EQ(maq_camera_health_copy_map(health.get(), nullptr, cells), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_camera_health_copy_map(health.get(), values.data(), cells), MAQ_OK);
  maq_camera_health_stats stats{};
  EXPECT_EQ(maq_camera_health_get_stats(health.get(), &stats), MAQ_ERROR_INVALID_ARGUMENT);
  std::vector<uint16_t> depth(64 * 48, 1000);
  maq_frame_desc desc;
  maquette::check(maq_frame_desc_init(&desc, sizeof desc));
  desc.format = MAQ_PIXEL_DEPTH16;
  desc.width_px = 64;
  desc.height_px = 48;
  desc.planes[0] = reinterpret_cast<const uint8_t*>(depth.data());
  const maquette::Frame depth_frame(context_, desc);
  EXPECT_EQ(maq_camera_health_push(health.get(), depth_frame.get(), &result), MAQ_ERROR_UNSUPPORTED);
}

}  // namespace
