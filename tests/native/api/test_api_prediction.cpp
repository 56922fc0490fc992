// Predictors through the C API: frames in and out, marks, statuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "support/temp_folder.h"

namespace {

std::string text() { return maq_last_error(nullptr); }

class ApiPrediction : public testing::Test {
 protected:
  maquette::Frame frame(int number) const {
    maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30");
    for (int i = 0; i < number; ++i) source.next();
    return std::move(*source.next());
  }

  const maquette::Context context_;
};

TEST_F(ApiPrediction, AFramePredictedIsOneOfTheStreamAndSaysThatItIsMadeUp) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30");
  maquette::Predictor predictor(context_);
  maq_frame_desc last{};
  for (int i = 0; i < 6; ++i) {
    const auto frame = source.next();
    EXPECT_EQ(frame->origin().kind, MAQ_FRAME_CAPTURED);
    EXPECT_EQ(frame->origin().horizon_ns, 0);
    EXPECT_FALSE(frame->is_predicted());
    last = frame->desc();
    predictor.push(*frame);
  }
  const maquette::Frame predicted = predictor.predict(0.1);
  const maq_frame_desc desc = predicted.desc();
  EXPECT_EQ(desc.format, last.format);
  EXPECT_EQ(desc.width_px, 320);
  EXPECT_EQ(desc.timestamp_ns, last.timestamp_ns + 100000000);
  const maq_frame_origin origin = predicted.origin();
  EXPECT_EQ(origin.kind, MAQ_FRAME_PREDICTED);
  EXPECT_EQ(origin.horizon_ns, 100000000);
  EXPECT_EQ(origin.age_ns, 100000000) << "of a media clock";
  EXPECT_EQ(origin.captured_timestamp_ns, last.timestamp_ns);
  EXPECT_EQ(origin.captured_sequence, last.sequence);
  EXPECT_TRUE(predicted.resized(64, 48).is_predicted()) << "a copy keeps it";
  const maq_predictor_stats stats = predictor.stats();
  EXPECT_EQ(stats.pushed_count, 6u);
  EXPECT_EQ(stats.predicted_count, 1u);
  EXPECT_EQ(stats.reset_count, 0u);
  EXPECT_GT(stats.push_ms, 0);
  EXPECT_GT(stats.predict_ms, 0);
}

std::vector<uint8_t> bytes_of(const maquette::Frame& frame) {
  std::vector<uint8_t> bytes(320 * 240 * 3);
  frame.copy_pixels(MAQ_PIXEL_BGR8, bytes.data(), 0, bytes.size());
  return bytes;
}

maq_predictor_config network_config(maq_network_mode mode) {
  maq_predictor_config config;
  maquette::check(maq_predictor_config_init(&config, sizeof config));
  config.method = MAQ_PREDICTION_NETWORK;
  config.network_mode = mode;
  config.bundle_path = MAQ_TEST_DATA "/tiny_transformer/bundle";
  config.threads = 1;
  return config;
}

TEST_F(ApiPrediction, ByNetworksItIsAnotherPictureOfTheSameTimeAndSize) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=5");
  maquette::Predictor automatic(context_), mended(context_, network_config(MAQ_NETWORK_AUTO)),
      expected(context_, network_config(MAQ_NETWORK_EXPECTED)), drawn(context_, network_config(MAQ_NETWORK_DRAWN));
  while (const auto frame = source.next()) {
    for (maquette::Predictor* const predictor : {&automatic, &mended, &expected, &drawn}) predictor->push(*frame);
  }
  const maquette::Frame base = automatic.predict(0.25), by_mended = mended.predict(0.25),
                        by_expected = expected.predict(0.25), by_drawn = drawn.predict(0.25);
  EXPECT_NE(bytes_of(by_mended), bytes_of(by_expected));
  for (const maquette::Frame* const frame : {&by_mended, &by_expected, &by_drawn}) {
    EXPECT_EQ(frame->desc().width_px, 320);
    EXPECT_EQ(frame->desc().format, base.desc().format);
    EXPECT_EQ(frame->origin().horizon_ns, 250000000);
    EXPECT_NE(bytes_of(*frame), bytes_of(base));
  }
  EXPECT_EQ(expected.stats().drawn_count, 0u);
  EXPECT_EQ(drawn.stats().drawn_count, 3u);
  EXPECT_GT(expected.stats().networks_ms, 0);
  EXPECT_EQ(automatic.stats().networks_ms, 0);
  const auto expect_runs = [](const maquette::Predictor& of, maq_network_mode mode, uint32_t steps, uint32_t passes) {
    const maq_predictor_stats stats = of.stats();
    EXPECT_EQ(stats.network_mode, mode);
    EXPECT_EQ(stats.step_count, steps) << mode;
    EXPECT_EQ(stats.pass_count, passes) << mode;
  };
  expect_runs(automatic, MAQ_NETWORK_AUTO, 0, 0);
  expect_runs(mended, MAQ_NETWORK_MENDED, 0, 1);
  expect_runs(expected, MAQ_NETWORK_EXPECTED, 0, 1);
  expect_runs(drawn, MAQ_NETWORK_DRAWN, 3 * 256, 0);
  mended.predict(0);  // nothing is to be foreseen
  expect_runs(mended, MAQ_NETWORK_AUTO, 0, 0);
  EXPECT_EQ(drawn.stats().pushed_count, 5u);
  drawn.reset();
  EXPECT_THROW(drawn.predict(0.1), maquette::Error);
}

TEST_F(ApiPrediction, NetworksThatABundleDoesNotHaveAndDrawsOutOfRangeAreRefused) {
  maq_predictor* made = nullptr;
  const auto refused = [&](const char* name, maq_status status, auto&& change) {
    maq_predictor_config config = network_config(MAQ_NETWORK_DRAWN);
    change(config);
    EXPECT_EQ(maq_predictor_create(context_.get(), &config, &made), status) << name;
    EXPECT_NE(text().find(name), std::string::npos) << text();
    EXPECT_EQ(made, nullptr);
  };
  refused("no networks", MAQ_ERROR_UNSUPPORTED,
          [](maq_predictor_config& config) { config.bundle_path = MAQ_TEST_DATA "/tiny_prediction/bundle"; });
  refused("/nowhere", MAQ_ERROR_NOT_FOUND, [](maq_predictor_config& config) { config.bundle_path = "/nowhere"; });
  for (const float temperature : {-1.0f, std::nanf("")}) {
    refused("temperature", MAQ_ERROR_INVALID_ARGUMENT,
            [&](maq_predictor_config& config) { config.temperature = temperature; });
  }
  refused("top_k", MAQ_ERROR_INVALID_ARGUMENT, [](maq_predictor_config& config) { config.top_k = 17; });
  refused("network_mode", MAQ_ERROR_INVALID_ARGUMENT, [](maq_predictor_config& config) {
    const int unknown = 4;
    std::memcpy(&config.network_mode, &unknown, sizeof unknown);
  });
}

TEST_F(ApiPrediction, SamplesAreMarkedFramesThatDependOnNoOther) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=5");
  maq_predictor_config config = network_config(MAQ_NETWORK_DRAWN);
  config.temperature = 1;
  config.seed = 4;
  maquette::Predictor predictor(context_, config);
  config.threads = 2;
  maquette::Predictor other(context_, config);
  const auto first = source.next();
  predictor.push(*first);
  other.push(*first);
  predictor.draw(2, 1, 0.1);
  EXPECT_EQ(bytes_of(predictor.drawn(1, 1)), bytes_of(*first)) << "nothing is known to move";
  EXPECT_EQ(predictor.uncertainty(1, 1), std::vector<float>(256, 0.0f));
  while (const auto frame = source.next()) {
    predictor.push(*frame);
    other.push(*frame);
  }
  predictor.draw(3, 2, 0.1);
  EXPECT_EQ(predictor.stats().drawn_count, 6u);
  EXPECT_EQ(predictor.stats().step_count, 2 * 256u) << "of all samples at once";
  EXPECT_EQ(predictor.stats().pass_count, 0u);
  const maquette::Frame drawn = predictor.drawn(1, 2);
  const std::vector<float> bits = predictor.uncertainty(1, 2);
  EXPECT_EQ(drawn.desc().width_px, 320);
  EXPECT_TRUE(drawn.is_predicted());
  EXPECT_EQ(drawn.origin().horizon_ns, 200000000);
  EXPECT_EQ(bits.size(), 256u);
  EXPECT_GT(*std::max_element(bits.begin(), bits.end()), 0.5f);
  EXPECT_LE(*std::max_element(bits.begin(), bits.end()), 4.0f) << "log2 of 16 entries";
  EXPECT_NE(bytes_of(drawn), bytes_of(predictor.drawn(0, 2)));
  EXPECT_NE(bytes_of(drawn), bytes_of(predictor.drawn(1, 1)));
  for (maquette::Predictor* const again : {&predictor, &other}) {
    again->draw(2, 3, 0.1);  // fewer samples, more frames, other threads
    EXPECT_EQ(bytes_of(again->drawn(1, 2)), bytes_of(drawn));
    EXPECT_EQ(again->uncertainty(1, 2), bits);
  }
  config.seed = 5;
  maquette::Predictor another(context_, config);
  maquette::Source same(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=5");
  while (const auto frame = same.next()) another.push(*frame);
  another.draw(2, 2, 0.1);
  EXPECT_NE(another.uncertainty(1, 2), bits);
}

TEST_F(ApiPrediction, PassesAreCountedUntilTheySettle) {
  maq_predictor_config config = network_config(MAQ_NETWORK_DRAWN);
  config.passes = 2;
  config.temperature = 1;
  maquette::Predictor two(context_, config);
  config.passes = 16;
  config.temperature = 0;
  maquette::Predictor until_settled(context_, config);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=4");
  while (const auto frame = source.next()) {
    two.push(*frame);
    until_settled.push(*frame);
    two.draw(1, 1, 0.1);
    EXPECT_EQ(two.stats().pass_count == 0, two.stats().pushed_count == 1) << "then nothing is known to move";
  }
  two.draw(3, 2, 0.1);
  until_settled.draw(1, 1, 0.1);
  EXPECT_EQ(two.stats().network_mode, MAQ_NETWORK_DRAWN);
  EXPECT_EQ(two.stats().pass_count, 3 * 2 * 2u);
  EXPECT_EQ(two.stats().step_count, 0u);
  EXPECT_GT(until_settled.stats().pass_count, 1u);
  EXPECT_LE(until_settled.stats().pass_count, 16u);
}

TEST_F(ApiPrediction, PredictorsThatShareNetworksDrawAsAloneAndOutliveOneAnother) {
  maq_predictor_config config = network_config(MAQ_NETWORK_DRAWN);
  config.temperature = 1;
  maquette::Predictor alone(context_, config);
  auto first = std::make_unique<maquette::Predictor>(context_, config);
  config.networks_of = first->get();
  config.bundle_path = "/nowhere";  // not read
  maquette::Predictor second(context_, config);
  config.seed = 8;
  maquette::Predictor other_seed(context_, config);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=4");
  while (const auto frame = source.next()) {
    for (maquette::Predictor* const each : {&alone, first.get(), &second, &other_seed}) each->push(*frame);
    if (frame->desc().sequence == 1) first->draw(2, 1, 0.1);  // of another stream
  }
  for (maquette::Predictor* const each : {&alone, first.get(), &second, &other_seed}) each->draw(1, 2, 0.1);
  const std::vector<float> bits = alone.uncertainty(0, 2);
  EXPECT_EQ(second.uncertainty(0, 2), bits);
  EXPECT_EQ(first->uncertainty(0, 2), bits);
  EXPECT_NE(other_seed.uncertainty(0, 2), bits);
  first.reset();
  second.draw(1, 2, 0.1);
  EXPECT_EQ(second.uncertainty(0, 2), bits);
  const maquette::Predictor without(context_);
  maq_predictor* made = nullptr;
  config.networks_of = without.get();
  EXPECT_EQ(maq_predictor_create(context_.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text().find("config.networks_of has no networks"), std::string::npos) << text();
  config.networks_of = reinterpret_cast<const maq_predictor*>(context_.get());
  EXPECT_EQ(maq_predictor_create(context_.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text().find("config.networks_of is a maq_context"), std::string::npos) << text();
}

TEST_F(ApiPrediction, WhatWasNotDrawnIsToldAndForgottenWithTheFrames) {
  maquette::Predictor predictor(context_, network_config(MAQ_NETWORK_DRAWN)), automatic(context_),
      expected(context_, network_config(MAQ_NETWORK_EXPECTED));
  maq_frame* made = nullptr;
  std::vector<float> bits(256);
  const auto refused = [&](maq_status status, maq_status expected_status, const char* words) {
    EXPECT_EQ(status, expected_status) << words;
    EXPECT_NE(text().find(words), std::string::npos) << text();
    EXPECT_EQ(made, nullptr);
  };
  constexpr maq_status kWrong = MAQ_ERROR_INVALID_ARGUMENT;
  refused(maq_predictor_draw(predictor.get(), 1, 1, 0.1), kWrong, "No frame was pushed");
  for (maquette::Predictor* const each : {&predictor, &automatic, &expected}) each->push(frame(0));
  refused(maq_predictor_draw(automatic.get(), 1, 1, 0.1), MAQ_ERROR_UNSUPPORTED, "draws no samples");
  refused(maq_predictor_draw(expected.get(), 1, 1, 0.1), MAQ_ERROR_UNSUPPORTED, "draws no samples");
  refused(maq_predictor_acquire_drawn(automatic.get(), 0, 1, &made), MAQ_ERROR_UNSUPPORTED, "draws no samples");
  refused(maq_predictor_draw(predictor.get(), 0, 1, 0.1), kWrong, "sample_count is 0");
  refused(maq_predictor_draw(predictor.get(), 17, 1, 0.1), kWrong, "sample_count is 17");
  refused(maq_predictor_draw(predictor.get(), 1, 65, 0.1), kWrong, "frame_count is 65");
  for (const double step_s : {0.0, -0.1, 0.1251, std::nan(""), double(std::numeric_limits<float>::infinity())}) {
    refused(maq_predictor_draw(predictor.get(), 1, 1, step_s), kWrong, "step_s is");
  }
  refused(maq_predictor_acquire_drawn(predictor.get(), 0, 1, &made), kWrong, "Frame 1 of sample 0 was asked for");
  predictor.draw(2, 3, 0.1);
  refused(maq_predictor_acquire_drawn(predictor.get(), 2, 1, &made), kWrong, "3 frames (from 1) of 2 samples");
  refused(maq_predictor_acquire_drawn(predictor.get(), 1, 0, &made), kWrong, "Frame 0");
  refused(maq_predictor_acquire_drawn(predictor.get(), 1, 4, &made), kWrong, "Frame 4");
  refused(maq_predictor_acquire_drawn(predictor.get(), 1, 3, nullptr), kWrong, "frame is NULL");
  refused(maq_predictor_copy_uncertainty(predictor.get(), 1, 3, bits.data(), 255), kWrong, "room for 255");
  refused(maq_predictor_copy_uncertainty(predictor.get(), 1, 3, nullptr, 256), kWrong, "bits is NULL");
  EXPECT_EQ(maq_predictor_copy_uncertainty(predictor.get(), 1, 3, bits.data(), 256), MAQ_OK);
  predictor.push(frame(1));
  refused(maq_predictor_acquire_drawn(predictor.get(), 0, 1, &made), kWrong, "0 frames");
  predictor.draw(2, 3, 0.1);
  predictor.reset();
  refused(maq_predictor_copy_uncertainty(predictor.get(), 0, 1, bits.data(), 256), kWrong, "0 frames");
  maq_predictor_config config = network_config(MAQ_NETWORK_DRAWN);
  config.passes = 17;
  maq_predictor* none = nullptr;
  EXPECT_EQ(maq_predictor_create(context_.get(), &config, &none), kWrong);
  EXPECT_NE(text().find("config.passes is 17"), std::string::npos) << text();
  EXPECT_EQ(maq_predictor_draw(nullptr, 1, 1, 0.1), kWrong);
}

TEST_F(ApiPrediction, TheAgeOfALiveFrameGrows) {
  std::vector<uint8_t> pixels(64 * 64, 50);
  maq_frame_desc desc{};
  maq_frame_desc_init(&desc, sizeof desc);
  desc.format = MAQ_PIXEL_GREY8;
  desc.width_px = desc.height_px = 64;
  desc.planes[0] = pixels.data();
  desc.clock = MAQ_CLOCK_MONOTONIC;
  desc.timestamp_ns = 1000;  // after the start of the machine
  maquette::Predictor predictor(context_);
  predictor.push(maquette::Frame(context_, desc));
  const maquette::Frame predicted = predictor.predict(0.5);
  const maq_frame_origin first = predicted.origin(), second = predicted.origin();
  EXPECT_EQ(first.horizon_ns, 500000000);
  EXPECT_GT(first.age_ns, 0);
  EXPECT_GE(second.age_ns, first.age_ns);
}

TEST_F(ApiPrediction, AFrameOfThePoolThatIsUsedAgainIsNoLongerMarked) {
  maquette::Source source(context_, "stub:pattern?size=64x64&fps=30");
  maquette::Predictor predictor(context_);
  predictor.push(*source.next());
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(predictor.predict(0.1).is_predicted());
    EXPECT_FALSE(source.next()->is_predicted());
  }
}

TEST_F(ApiPrediction, SavedPicturesKeepTheMark) {
  const TempFolder folder;
  maquette::Predictor predictor(context_);
  predictor.push(frame(3));
  const maquette::Frame predicted = predictor.predict(0.25);
  for (const char* name : {"a.png", "a.jpg", "a.jpeg"}) {
    const std::string path = folder.file(name);
    predicted.save(path);
    const std::string bytes = read_text(path);
    const maquette::Frame decoded = maquette::Frame::decode(context_, bytes.data(), bytes.size());
    for (const char* options : {"", "?size=160x120"}) {
      const maquette::Frame read = std::move(*maquette::Source(context_, "image:" + path + options).next());
      for (const maquette::Frame* found : {&decoded, &read}) {
        EXPECT_EQ(found->origin().kind, MAQ_FRAME_PREDICTED) << name;
        EXPECT_EQ(found->origin().horizon_ns, 250000000);
        EXPECT_EQ(found->origin().captured_timestamp_ns, predicted.origin().captured_timestamp_ns);
        EXPECT_EQ(found->origin().captured_sequence, 3u);
      }
    }
    frame(3).save(path);
    EXPECT_FALSE(maquette::Source(context_, "image:" + path).next()->is_predicted()) << name;
  }
  std::vector<uint8_t> one(320 * 240 * 3), other(one.size());
  predicted.save(folder.file("b.png"));
  predicted.copy_pixels(MAQ_PIXEL_BGR8, one.data(), 0, one.size());
  maquette::Source(context_, "image:" + folder.file("b.png"))
      .next()
      ->copy_pixels(MAQ_PIXEL_BGR8, other.data(), 0, other.size());
  EXPECT_EQ(one, other) << "the picture is the same";
}

TEST_F(ApiPrediction, RecordersRefusePredictedFramesUnlessTheyKeepThemMarked) {
  const TempFolder folder;
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=30");
  maquette::Predictor predictor(context_);
  const auto first = source.next(), second = source.next();
  predictor.push(*first);
  predictor.push(*second);
  const maquette::Frame predicted = predictor.predict(0.1);
  {
    maquette::Recorder recorder(context_, folder.file("refused.maqrec"), &source);
    recorder.add(*first);
    EXPECT_EQ(maq_recorder_add_frame(recorder.get(), predicted.get()), MAQ_ERROR_UNSUPPORTED);
    EXPECT_NE(text().find("keep_predicted"), std::string::npos);
    recorder.add(*second);
    recorder.finish();
    EXPECT_EQ(recorder.info().frame_count, 2u);
  }
  maq_recorder_config config{};
  maquette::check(maq_recorder_config_init(&config, sizeof config));
  EXPECT_EQ(config.keep_predicted, 0);
  config.keep_predicted = 1;
  for (const uint32_t quality : {0u, 90u}) {
    const std::string path = folder.file("kept" + std::to_string(quality) + ".maqrec");
    config.jpeg_quality = quality;
    maquette::Recorder recorder(context_, path, &source, &config);
    recorder.add(*first);
    recorder.add(*second);
    recorder.add(predicted);
    recorder.finish();
    for (const char* options : {"", "?size=160x120", "?live=1&speed=20"}) {
      maq_source_config all = maquette::default_source_config();
      all.queue_length = 8;
      maquette::Source played(context_, "rec:" + path + options, &all);
      for (int i = 0; i < 3; ++i) {
        const auto frame = played.next();
        ASSERT_TRUE(frame) << options;
        EXPECT_EQ(frame->is_predicted(), i == 2) << options;
        EXPECT_EQ(frame->origin().horizon_ns, i == 2 ? 100000000 : 0) << options;
      }
    }
  }
  config.keep_predicted = 2;
  maq_recorder* made = nullptr;
  EXPECT_EQ(maq_recorder_create(context_.get(), folder.file("x").c_str(), nullptr, &config, &made),
            MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text().find("config.keep_predicted is 2"), std::string::npos);
}

TEST_F(ApiPrediction, ThePoolIsBoundedAndOutlivesThePredictor) {
  maq_predictor_config config = maquette::default_predictor_config();
  config.frame_pool_size = 2;
  config.threads = 1;
  auto predictor = std::make_unique<maquette::Predictor>(context_, config);
  predictor->push(frame(0));
  maquette::Frame one = predictor->predict(0), other = predictor->predict(1);
  maq_frame* third = nullptr;
  EXPECT_EQ(maq_predictor_predict(predictor->get(), 0, &third), MAQ_ERROR_POOL_EMPTY);
  EXPECT_NE(text().find("predicted frames"), std::string::npos);
  predictor.reset();
  EXPECT_EQ(one.desc().width_px, 320);
}

TEST_F(ApiPrediction, WhatIsWrongIsTold) {
  maquette::Predictor predictor(context_);
  maq_frame* made = nullptr;
  EXPECT_EQ(maq_predictor_predict(predictor.get(), 0.1, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text().find("No frame was pushed"), std::string::npos);
  predictor.push(frame(0));
  for (const double wrong : {-0.001, 10.001, 1e300, double(std::numeric_limits<float>::infinity()), std::nan("")}) {
    EXPECT_EQ(maq_predictor_predict(predictor.get(), wrong, &made), MAQ_ERROR_INVALID_ARGUMENT) << wrong;
    EXPECT_NE(text().find("ahead_s is"), std::string::npos);
  }
  EXPECT_EQ(maq_predictor_predict(predictor.get(), 0.1, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_predictor_push(predictor.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_predictor_push(nullptr, frame(0).get()), MAQ_ERROR_INVALID_ARGUMENT);
  const maquette::Source solids(context_, "stub:solids?scene=box&seed=1&fps=1&size=64x64");
  EXPECT_EQ(maq_predictor_reset(nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  predictor.reset();
  EXPECT_EQ(maq_predictor_predict(predictor.get(), 0.1, &made), MAQ_ERROR_INVALID_ARGUMENT) << "nothing is left";
  EXPECT_EQ(made, nullptr);
  maq_predictor_destroy(nullptr);
}

TEST_F(ApiPrediction, ConfigsAndStructsOutOfRangeAreRefused) {
  maq_predictor* made = nullptr;
  const auto refused = [&](const char* name, auto&& change) {
    maq_predictor_config config = maquette::default_predictor_config();
    change(config);
    EXPECT_EQ(maq_predictor_create(context_.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT) << name;
    EXPECT_NE(text().find(std::string("config.") + name), std::string::npos) << text();
  };
  refused("threads", [](maq_predictor_config& config) { config.threads = -1; });
  refused("threads", [](maq_predictor_config& config) { config.threads = 65; });
  refused("method", [](maq_predictor_config& config) {
    const int32_t unknown = 4;
    std::memcpy(&config.method, &unknown, sizeof unknown);
  });
  refused("frame_pool_size", [](maq_predictor_config& config) { config.frame_pool_size = 0; });
  refused("frame_pool_size", [](maq_predictor_config& config) { config.frame_pool_size = 65; });
  refused("struct_size", [](maq_predictor_config& config) { config.struct_size = 3; });
  EXPECT_EQ(maq_predictor_create(nullptr, nullptr, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_predictor_create(context_.get(), nullptr, nullptr), MAQ_ERROR_INVALID_ARGUMENT);
  const maquette::Predictor predictor(context_);
  maq_predictor_stats stats{};
  EXPECT_EQ(maq_predictor_get_stats(predictor.get(), &stats), MAQ_ERROR_INVALID_ARGUMENT);
  const maquette::Frame captured = frame(0);
  maq_frame_origin origin{};
  EXPECT_EQ(maq_frame_get_origin(captured.get(), &origin), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_frame_get_origin(nullptr, &origin), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(maq_frame_get_origin(captured.get(), nullptr), MAQ_ERROR_INVALID_ARGUMENT);
}

}  // namespace
