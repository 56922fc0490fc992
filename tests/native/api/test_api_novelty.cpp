// Novelty through the C API: scores and maps, streams that share networks, statuses.
#include <gtest/gtest.h>

#include <cmath>
#include <maquette/maquette.hpp>
#include <string>
#include <thread>
#include <vector>

#include "support/temp_folder.h"

namespace {

const std::string kTinyBundle = std::string(MAQ_TEST_DATA) + "/tiny_prediction/bundle";

maq_novelty_config novelty_config(const std::string& bundle = kTinyBundle) {
  maq_novelty_config config = maquette::default_novelty_config();
  config.model.bundle_path = bundle.c_str();
  config.model.threads = 1;
  return config;
}

std::string last_text() { return maq_last_error(nullptr); }

class ApiNovelty : public testing::Test {
 protected:
  const maquette::Context context_;
};

TEST_F(ApiNovelty, ScoresAndMapsOfAStream) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30&frames=20");
  maquette::Novelty novelty(context_, novelty_config());
  int frames = 0;
  while (const auto frame = source.next()) {
    const maq_novelty_score score = novelty.push(*frame);
    EXPECT_EQ(score.columns, 16);
    EXPECT_EQ(score.rows, 16);
    EXPECT_EQ(score.is_stream_start, frames == 0 ? 1 : 0);
    EXPECT_TRUE(std::isfinite(score.bits) && score.bits >= 0);
    const std::vector<float> map = novelty.map();
    double sum = 0;
    for (const float bits : map) sum += double(bits);
    EXPECT_NEAR(sum / 256, double(score.bits), 1e-4);
    ++frames;
  }
  const maq_novelty_stats stats = novelty.stats();
  EXPECT_EQ(stats.pushed_count, 20u);
  EXPECT_EQ(stats.stream_start_count, 1u);
  EXPECT_EQ(stats.threads, 1);
  EXPECT_GT(stats.network_ms, 0);
  EXPECT_GE(stats.push_ms, stats.network_ms);
  novelty.reset();
  maq_novelty_score score{};
  float bits[256];
  EXPECT_EQ(maq_novelty_copy_map(novelty.get(), bits, 256), MAQ_ERROR_INVALID_ARGUMENT) << "nothing is left";
  score.struct_size = sizeof score;
}

TEST_F(ApiNovelty, TheInstalledBundleFindsACutAsAnEvent) {
  maquette::Novelty novelty(context_);
  maquette::Source one(context_, "stub:people?count=2&seed=3&size=320x240&fps=30");
  maquette::Source other(context_, "stub:pattern?size=320x240&fps=30");
  for (int i = 0; i < 15; ++i) EXPECT_EQ(novelty.push(*one.next()).is_event, 0) << i;
  for (int i = 0; i < 15; ++i) other.next();
  const maq_novelty_score score = novelty.push(*other.next());
  EXPECT_EQ(score.is_stream_start, 0);
  EXPECT_EQ(score.is_cut, 1);
  EXPECT_EQ(score.is_event, 1);
  EXPECT_EQ(novelty.stats().event_count, 1u);
}

TEST_F(ApiNovelty, TheReconstructionIsLikeTheFrameAndMarkedAsPredicted) {
  maquette::Novelty novelty(context_);
  maq_frame* made = nullptr;
  EXPECT_EQ(maq_novelty_acquire_reconstruction(novelty.get(), &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("No frame was pushed"), std::string::npos);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=64x64&fps=30");
  source.next();
  const auto frame = source.next();
  novelty.push(*frame);
  const maquette::Frame reconstruction = novelty.reconstruction();
  EXPECT_EQ(reconstruction.desc().width_px, 64);
  EXPECT_EQ(reconstruction.desc().timestamp_ns, frame->desc().timestamp_ns);
  EXPECT_EQ(reconstruction.origin().kind, MAQ_FRAME_PREDICTED);
  EXPECT_EQ(reconstruction.origin().horizon_ns, 0);
  EXPECT_EQ(reconstruction.origin().captured_sequence, 1u);
  std::vector<uint8_t> one(64 * 64 * 3), other(one.size());
  reconstruction.copy_pixels(MAQ_PIXEL_RGB8, one.data(), 0, one.size());
  frame->copy_pixels(MAQ_PIXEL_RGB8, other.data(), 0, other.size());
  double squares = 0;
  for (size_t i = 0; i < one.size(); ++i) squares += std::pow(double(one[i]) - double(other[i]), 2);
  EXPECT_LT(std::sqrt(squares / double(one.size())), 30) << "of 255, of a kind of picture that it was not trained on";
  std::vector<maquette::Frame> held;
  for (int i = 0; i < 3; ++i) held.push_back(novelty.reconstruction());
  EXPECT_EQ(maq_novelty_acquire_reconstruction(novelty.get(), &made), MAQ_ERROR_POOL_EMPTY);
  EXPECT_EQ(made, nullptr);
}

TEST_F(ApiNovelty, StreamsShareNetworksThatOutliveTheFirst) {
  maq_novelty_config config = novelty_config();
  auto first = std::make_unique<maquette::Novelty>(context_, config);
  const std::string missing = "/nowhere";
  config.shared_with = first->get();
  config.model.bundle_path = missing.c_str();
  maquette::Novelty second(context_, config);
  config.shared_with = second.get();
  maquette::Novelty third(context_, config);
  first.reset();
  const auto run = [&](maquette::Novelty& of, const char* uri) {
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

TEST_F(ApiNovelty, WhatIsWrongIsTold) {
  maquette::Novelty novelty(context_, novelty_config());
  const maquette::Frame frame = std::move(*maquette::Source(context_, "stub:pattern?size=64x48").next());
  maq_novelty_score score{};
  EXPECT_EQ(maq_novelty_push(novelty.get(), frame.get(), &score), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("score.struct_size"), std::string::npos);
  EXPECT_EQ(novelty.stats().pushed_count, 0u) << "refused before the frame was seen";
  score.struct_size = sizeof score;
  EXPECT_EQ(maq_novelty_push(novelty.get(), nullptr, &score), MAQ_ERROR_INVALID_ARGUMENT);
  std::vector<float> bits(256);
  EXPECT_EQ(maq_novelty_copy_map(novelty.get(), bits.data(), 256), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("No frame was pushed"), std::string::npos);
  EXPECT_EQ(maq_novelty_push(novelty.get(), frame.get(), &score), MAQ_OK);
  EXPECT_EQ(maq_novelty_copy_map(novelty.get(), bits.data(), 255), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(last_text().find("capacity is 255, but the map has 256 cells"), std::string::npos);
  EXPECT_EQ(maq_novelty_copy_map(novelty.get(), nullptr, 256), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_novelty_copy_map(novelty.get(), bits.data(), 256), MAQ_OK);
  maq_novelty_stats stats{};
  EXPECT_EQ(maq_novelty_get_stats(novelty.get(), &stats), MAQ_ERROR_INVALID_ARGUMENT);
  std::vector<uint16_t> depth(64 * 48, 1000);
  maq_frame_desc desc;
  maquette::check(maq_frame_desc_init(&desc, sizeof desc));
  desc.format = MAQ_PIXEL_DEPTH16;
  desc.width_px = 64;
  desc.height_px = 48;
  desc.planes[0] = reinterpret_cast<const uint8_t*>(depth.data());
  const maquette::Frame depth_frame(context_, desc);
  EXPECT_EQ(maq_novelty_push(novelty.get(), depth_frame.get(), &score), MAQ_ERROR_UNSUPPORTED);
}

TEST_F(ApiNovelty, TheTransformerOfTheBundleIsUsedUnlessBigramsAreAskedFor) {
  maq_novelty_config config = novelty_config();
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_transformer/bundle";
  maquette::Novelty by_transformer(context_, config);
  config.shared_with = by_transformer.get();
  maquette::Novelty sharing(context_, config);
  config.method = MAQ_NOVELTY_BIGRAM;
  maquette::Novelty sharing_bigram(context_, config);
  config.shared_with = nullptr;
  maquette::Novelty by_bigram(context_, config);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30&frames=6");
  for (int i = 0; const auto frame = source.next(); ++i) {
    const float bits = by_transformer.push(*frame).bits, by_bigram_bits = by_bigram.push(*frame).bits;
    EXPECT_EQ(bits, sharing.push(*frame).bits);
    EXPECT_EQ(by_bigram_bits, sharing_bigram.push(*frame).bits);
    EXPECT_EQ(bits == by_bigram_bits, i == 0) << i;
    EXPECT_EQ(by_transformer.stats().transformer_ms > 0, i > 0);
    EXPECT_EQ(by_bigram.stats().transformer_ms, 0);
  }
}

TEST_F(ApiNovelty, ConfigsOutOfRangeAreRefused) {
  maq_novelty* made = nullptr;
  const auto refused = [&](const char* name, auto&& change, maq_status status = MAQ_ERROR_INVALID_ARGUMENT) {
    maq_novelty_config config = novelty_config();
    change(config);
    EXPECT_EQ(maq_novelty_create(context_.get(), &config, &made), status) << name;
    EXPECT_NE(last_text().find(name), std::string::npos) << last_text();
    EXPECT_EQ(made, nullptr);
  };
  refused(
      "/nowhere", [](maq_novelty_config& config) { config.model.bundle_path = "/nowhere"; }, MAQ_ERROR_NOT_FOUND);
  refused(
      "edges", [](maq_novelty_config& config) { config.model.bundle_path = MAQ_TEST_DATA "/tiny_edges/bundle"; },
      MAQ_ERROR_UNSUPPORTED);
}

}  // namespace
