// Surprise through the C API: scores and maps, streams that share networks, statuses.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <maquette/maquette.hpp>
#include <string>
#include <thread>
#include <vector>

#include "support/temp_folder.h"

namespace {

const std::string kTinyBundle = std::string(MAQ_TEST_DATA) + "/tiny_prediction/bundle";

maq_surprise_config surprise_config(const std::string& bundle = kTinyBundle) {
  maq_surprise_config config = maquette::default_surprise_config();
  config.bundle_path = bundle.c_str();
  config.threads = 1;
  return config;
}

std::string last_text() { return maq_last_error(nullptr); }

class ApiSurprise : public testing::Test {
 protected:
  const maquette::Context context_;
};

TEST_F(ApiSurprise, ScoresAndMapsOfAStream) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30&frames=20");
  maquette::Surprise surprise(context_, surprise_config());
  int frames = 0;
  while (const auto frame = source.next()) {
    const maq_surprise_score score = surprise.push(*frame);
    EXPECT_EQ(score.columns, 16);
    EXPECT_EQ(score.rows, 16);
    EXPECT_EQ(score.is_start, frames == 0 ? 1 : 0);
    EXPECT_TRUE(std::isfinite(score.bits) && score.bits >= 0);
    const std::vector<float> map = surprise.map();
    double sum = 0;
    for (const float bits : map) sum += double(bits);
    EXPECT_NEAR(sum / 256, double(score.bits), 1e-4);
    ++frames;
  }
  const maq_surprise_stats stats = surprise.stats();
  EXPECT_EQ(stats.pushed_count, 20u);
  EXPECT_EQ(stats.start_count, 1u);
  EXPECT_EQ(stats.threads, 1);
  EXPECT_GT(stats.network_ms, 0);
  EXPECT_GE(stats.push_ms, stats.network_ms);
  surprise.reset();
  maq_surprise_score score{};
  float bits[256];
  EXPECT_EQ(maq_surprise_copy_map(surprise.get(), bits, 256), MAQ_ERROR_INVALID_ARGUMENT) << "nothing is left";
  score.struct_size = sizeof score;
}

TEST_F(ApiSurprise, TheInstalledBundleFindsACutAsAnEvent) {
  maquette::Surprise surprise(context_);
  maquette::Source one(context_, "stub:people?count=2&seed=3&size=320x240&fps=30");
  maquette::Source other(context_, "stub:pattern?size=320x240&fps=30");
  for (int i = 0; i < 15; ++i) EXPECT_EQ(surprise.push(*one.next()).is_event, 0) << i;
  for (int i = 0; i < 15; ++i) other.next();
  const maq_surprise_score score = surprise.push(*other.next());
  EXPECT_EQ(score.is_start, 0);
  EXPECT_EQ(score.is_cut, 1);
  EXPECT_EQ(score.is_event, 1);
  EXPECT_EQ(surprise.stats().event_count, 1u);
}

TEST_F(ApiSurprise, WhatTheNetworkSawIsAPictureLikeTheFrameAndMarkedAsMadeUp) {
  maquette::Surprise surprise(context_);
  maq_frame* made = nullptr;
  EXPECT_EQ(maq_surprise_acquire_rebuilt(surprise.get(), &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("No frame was pushed"), std::string::npos);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=64x64&fps=30");
  source.next();
  const auto frame = source.next();
  surprise.push(*frame);
  const maquette::Frame rebuilt = surprise.rebuilt();
  EXPECT_EQ(rebuilt.desc().width_px, 64);
  EXPECT_EQ(rebuilt.desc().timestamp_ns, frame->desc().timestamp_ns);
  EXPECT_EQ(rebuilt.origin().kind, MAQ_FRAME_PREDICTED);
  EXPECT_EQ(rebuilt.origin().horizon_ns, 0);
  EXPECT_EQ(rebuilt.origin().captured_sequence, 1u);
  std::vector<uint8_t> one(64 * 64 * 3), other(one.size());
  rebuilt.copy_pixels(MAQ_PIXEL_RGB8, one.data(), 0, one.size());
  frame->copy_pixels(MAQ_PIXEL_RGB8, other.data(), 0, other.size());
  double squares = 0;
  for (size_t i = 0; i < one.size(); ++i) squares += std::pow(double(one[i]) - double(other[i]), 2);
  EXPECT_LT(std::sqrt(squares / double(one.size())), 30) << "of 255, of a kind of picture that it was not trained on";
  std::vector<maquette::Frame> held;
  for (int i = 0; i < 3; ++i) held.push_back(surprise.rebuilt());
  EXPECT_EQ(maq_surprise_acquire_rebuilt(surprise.get(), &made), MAQ_ERROR_POOL_EMPTY);
  EXPECT_EQ(maq_surprise_acquire_rebuilt(surprise.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(made, nullptr);
}

TEST_F(ApiSurprise, StreamsShareNetworksThatOutliveTheFirst) {
  maq_surprise_config config = surprise_config();
  auto first = std::make_unique<maquette::Surprise>(context_, config);
  const std::string missing = "/nowhere";
  config.networks_of = first->get();
  config.bundle_path = missing.c_str();
  maquette::Surprise second(context_, config);
  config.networks_of = second.get();
  maquette::Surprise third(context_, config);
  first.reset();
  const auto run = [&](maquette::Surprise& of, const char* uri) {
    maquette::Source source(context_, uri);
    std::vector<float> bits;
    while (const auto frame = source.next()) bits.push_back(of.push(*frame).bits);
    return bits;
  };
  const char* const people = "stub:people?count=2&seed=3&size=160x120&fps=30&frames=30";
  const std::vector<float> alone = run(second, people);
  second.reset();
  std::vector<float> beside;
  std::thread thread([&] { run(third, "stub:pattern?size=200x100&fps=30&frames=30"); });
  beside = run(second, people);
  thread.join();
  EXPECT_EQ(alone, beside);
}

TEST_F(ApiSurprise, TheBundleMayLieInMemory) {
  std::vector<std::string> bytes;
  std::vector<maq_memory_file> files;
  const char* const names[] = {"manifest.json", "encoder.onnx", "decoder.onnx", "codes.maqc"};
  for (const char* name : names) bytes.push_back(read_text(kTinyBundle + "/" + name));
  for (size_t i = 0; i < 4; ++i) files.push_back({names[i], bytes[i].data(), bytes[i].size()});
  maq_surprise_config config = maquette::default_surprise_config();
  config.bundle_files = files.data();
  config.bundle_file_count = 4;
  maquette::Surprise surprise(context_, config);
  config.bundle_file_count = 3;
  maq_surprise* made = nullptr;
  EXPECT_EQ(maq_surprise_create(context_.get(), &config, &made), MAQ_ERROR_BAD_BUNDLE);
  EXPECT_NE(last_text().find("codes.maqc"), std::string::npos);
  EXPECT_EQ(made, nullptr);
}

TEST_F(ApiSurprise, WhatIsWrongIsTold) {
  maquette::Surprise surprise(context_, surprise_config());
  const maquette::Frame frame = std::move(*maquette::Source(context_, "stub:pattern?size=64x48").next());
  maq_surprise_score score{};
  EXPECT_EQ(maq_surprise_push(surprise.get(), frame.get(), &score), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("score.struct_size"), std::string::npos);
  EXPECT_EQ(surprise.stats().pushed_count, 0u) << "refused before the frame was seen";
  score.struct_size = sizeof score;
  EXPECT_EQ(maq_surprise_push(surprise.get(), nullptr, &score), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_surprise_push(nullptr, frame.get(), &score), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_surprise_push(surprise.get(), frame.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  std::vector<float> bits(256);
  EXPECT_EQ(maq_surprise_copy_map(surprise.get(), bits.data(), 256), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("No frame was pushed"), std::string::npos);
  EXPECT_EQ(maq_surprise_push(surprise.get(), frame.get(), &score), MAQ_OK);
  EXPECT_EQ(maq_surprise_copy_map(surprise.get(), bits.data(), 255), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("count is 255, but the map has 256 cells"), std::string::npos);
  EXPECT_EQ(maq_surprise_copy_map(surprise.get(), nullptr, 256), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_surprise_copy_map(surprise.get(), bits.data(), 256), MAQ_OK);
  maq_surprise_stats stats{};
  EXPECT_EQ(maq_surprise_get_stats(surprise.get(), &stats), MAQ_ERROR_INVALID_ARGUMENT);
  std::vector<uint16_t> depth(64 * 48, 1000);
  maq_frame_desc desc;
  maquette::check(maq_frame_desc_init(&desc, sizeof desc));
  desc.format = MAQ_PIXEL_DEPTH16;
  desc.width_px = 64;
  desc.height_px = 48;
  desc.planes[0] = reinterpret_cast<const uint8_t*>(depth.data());
  const maquette::Frame depth_frame(context_, desc);
  EXPECT_EQ(maq_surprise_push(surprise.get(), depth_frame.get(), &score), MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(maq_surprise_reset(nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  maq_surprise_destroy(nullptr);
}

TEST_F(ApiSurprise, TheTransformerSaysBitsWhereTheBundleHasItUnlessTheTableIsAskedFor) {
  maq_surprise_config config = surprise_config();
  config.bundle_path = MAQ_TEST_DATA "/tiny_transformer/bundle";
  maquette::Surprise by_transformer(context_, config);
  config.networks_of = by_transformer.get();
  maquette::Surprise sharing(context_, config);
  config.method = MAQ_SURPRISE_TABLE;
  maquette::Surprise sharing_table(context_, config);
  config.networks_of = nullptr;
  maquette::Surprise by_table(context_, config);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30&frames=6");
  for (int i = 0; const auto frame = source.next(); ++i) {
    const float bits = by_transformer.push(*frame).bits, of_table = by_table.push(*frame).bits;
    EXPECT_EQ(bits, sharing.push(*frame).bits);
    EXPECT_EQ(of_table, sharing_table.push(*frame).bits);
    EXPECT_EQ(bits == of_table, i == 0) << i;
    EXPECT_EQ(by_transformer.stats().transformer_ms > 0, i > 0);
    EXPECT_EQ(by_table.stats().transformer_ms, 0);
  }
}

TEST_F(ApiSurprise, ConfigsOutOfRangeAreRefused) {
  maq_surprise* made = nullptr;
  const auto refused = [&](const char* name, auto&& change, maq_status status = MAQ_ERROR_INVALID_ARGUMENT) {
    maq_surprise_config config = surprise_config();
    change(config);
    EXPECT_EQ(maq_surprise_create(context_.get(), &config, &made), status) << name;
    EXPECT_NE(last_text().find(name), std::string::npos) << last_text();
    EXPECT_EQ(made, nullptr);
  };
  for (const float ratio : {1.0f, 0.5f, -4.0f, 1e7f, std::nanf(""), std::numeric_limits<float>::infinity()}) {
    refused("config.event_ratio", [&](maq_surprise_config& config) { config.event_ratio = ratio; });
  }
  for (const int32_t threads : {-2, 65}) {
    refused("config.threads", [&](maq_surprise_config& config) { config.threads = threads; });
  }
  refused("config.allow_spinning", [](maq_surprise_config& config) { config.allow_spinning = 2; });
  refused("config.method", [](maq_surprise_config& config) {
    const int unknown = 2;
    std::memcpy(&config.method, &unknown, sizeof unknown);
  });
  refused("config.struct_size", [](maq_surprise_config& config) { config.struct_size = 3; });
  refused("config.networks_of is a maq_context", [&](maq_surprise_config& config) {
    config.networks_of = reinterpret_cast<const maq_surprise*>(context_.get());
  });
  refused(
      "/nowhere", [](maq_surprise_config& config) { config.bundle_path = "/nowhere"; }, MAQ_ERROR_NOT_FOUND);
  refused(
      "edges", [](maq_surprise_config& config) { config.bundle_path = MAQ_TEST_DATA "/tiny_edges/bundle"; },
      MAQ_ERROR_UNSUPPORTED);
  EXPECT_EQ(maq_surprise_create(nullptr, nullptr, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_surprise_create(context_.get(), nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
}

}  // namespace
