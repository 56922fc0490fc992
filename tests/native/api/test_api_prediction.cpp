// Predictors through the C API: frames in and out, marks, statuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

TEST_F(ApiPrediction, APredictedFrameFitsTheStreamAndIsMarked) {
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

maq_predictor_config network_config(maq_predictor_method method) {
  maq_predictor_config config;
  maquette::check(maq_predictor_config_init(&config, sizeof config));
  config.method = method;
  config.model.bundle_path = MAQ_TEST_DATA "/tiny_transformer/bundle";
  config.model.threads = 1;
  return config;
}

TEST_F(ApiPrediction, NetworksGiveAnotherImageOfTheSameTimeAndSize) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=5");
  maquette::Predictor automatic(context_), sampled(context_, network_config(MAQ_PREDICTOR_SAMPLED));
  while (const auto frame = source.next()) {
    for (maquette::Predictor* const predictor : {&automatic, &sampled}) predictor->push(*frame);
  }
  const maquette::Frame base = automatic.predict(0.25), by_sampled = sampled.predict(0.25);
  EXPECT_EQ(by_sampled.desc().width_px, 320);
  EXPECT_EQ(by_sampled.desc().format, base.desc().format);
  EXPECT_EQ(by_sampled.origin().horizon_ns, 250000000);
  EXPECT_NE(bytes_of(by_sampled), bytes_of(base));
  EXPECT_EQ(automatic.stats().networks_ms, 0);
  const auto expect_runs = [](const maquette::Predictor& of, maq_predictor_method method, uint32_t frames,
                              uint32_t cells) {
    const maq_predictor_stats stats = of.stats();
    EXPECT_EQ(stats.method, method);
    EXPECT_EQ(stats.sampled_frame_count, frames) << method;
    EXPECT_EQ(stats.step_count, 256 * frames) << method;
    EXPECT_EQ(stats.cell_count, cells) << method;
  };
  expect_runs(automatic, MAQ_PREDICTOR_AUTO, 0, 0);
  expect_runs(sampled, MAQ_PREDICTOR_SAMPLED, 3, 256);
  EXPECT_EQ(sampled.stats().pushed_count, 5u);
  sampled.reset();
  EXPECT_THROW(sampled.predict(0.1), maquette::Error);
}

TEST_F(ApiPrediction, MissingNetworksAndSettingsOutOfRangeAreRefused) {
  maq_predictor* created = nullptr;
  const auto refused = [&](const char* name, maq_status status, auto&& change) {
    maq_predictor_config config = network_config(MAQ_PREDICTOR_SAMPLED);
    change(config);
    EXPECT_EQ(maq_predictor_create(context_.get(), &config, &created), status) << name;
    EXPECT_NE(text().find(name), std::string::npos) << text();
    EXPECT_EQ(created, nullptr);
  };
  refused("no network for sampled", MAQ_ERROR_UNSUPPORTED,
          [](maq_predictor_config& config) { config.model.bundle_path = MAQ_TEST_DATA "/tiny_prediction/bundle"; });
  refused("/nowhere", MAQ_ERROR_NOT_FOUND, [](maq_predictor_config& config) { config.model.bundle_path = "/nowhere"; });
  for (const float temperature : {-1.0f, std::nanf("")}) {
    refused("temperature", MAQ_ERROR_INVALID_ARGUMENT,
            [&](maq_predictor_config& config) { config.temperature = temperature; });
  }
}

TEST_F(ApiPrediction, SamplesAreMarkedAndIndependentOfTheirNumber) {
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=5");
  maq_predictor_config config = network_config(MAQ_PREDICTOR_SAMPLED);
  config.temperature = 1;
  config.seed = 4;
  maquette::Predictor predictor(context_, config);
  config.model.threads = 2;
  maquette::Predictor other(context_, config);
  const auto first = source.next();
  predictor.push(*first);
  other.push(*first);
  predictor.sample(2, 1, 0.1);
  EXPECT_EQ(bytes_of(predictor.acquire_sample(1, 1)), bytes_of(*first)) << "nothing is known to move";
  EXPECT_EQ(predictor.entropy_map(1, 1), std::vector<float>(256, 0.0f));
  while (const auto frame = source.next()) {
    predictor.push(*frame);
    other.push(*frame);
  }
  predictor.sample(3, 2, 0.1);
  EXPECT_EQ(predictor.stats().sampled_frame_count, 6u);
  EXPECT_EQ(predictor.stats().step_count, 2 * 256u) << "of all samples at once";
  const maquette::Frame sampled = predictor.acquire_sample(1, 2);
  const std::vector<float> bits = predictor.entropy_map(1, 2);
  EXPECT_EQ(sampled.desc().width_px, 320);
  EXPECT_TRUE(sampled.is_predicted());
  EXPECT_EQ(sampled.origin().horizon_ns, 200000000);
  EXPECT_EQ(bits.size(), 256u);
  EXPECT_GT(*std::max_element(bits.begin(), bits.end()), 0.5f);
  EXPECT_LE(*std::max_element(bits.begin(), bits.end()), 4.0f) << "log2 of 16 entries";
  EXPECT_NE(bytes_of(sampled), bytes_of(predictor.acquire_sample(0, 2)));
  EXPECT_NE(bytes_of(sampled), bytes_of(predictor.acquire_sample(1, 1)));
  for (maquette::Predictor* const again : {&predictor, &other}) {
    again->sample(2, 3, 0.1);  // fewer samples, more frames, other threads
    EXPECT_EQ(bytes_of(again->acquire_sample(1, 2)), bytes_of(sampled));
    EXPECT_EQ(again->entropy_map(1, 2), bits);
  }
  config.seed = 5;
  maquette::Predictor another(context_, config);
  maquette::Source same(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=5");
  while (const auto frame = same.next()) another.push(*frame);
  another.sample(2, 2, 0.1);
  EXPECT_NE(another.entropy_map(1, 2), bits);
}

TEST_F(ApiPrediction, PredictorsThatShareNetworksSampleAsAloneAndOutliveOneAnother) {
  maq_predictor_config config = network_config(MAQ_PREDICTOR_SAMPLED);
  config.temperature = 1;
  maquette::Predictor alone(context_, config);
  auto first = std::make_unique<maquette::Predictor>(context_, config);
  config.shared_with = first->get();
  config.model.bundle_path = "/nowhere";  // not read
  maquette::Predictor second(context_, config);
  config.seed = 8;
  maquette::Predictor other_seed(context_, config);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=4");
  while (const auto frame = source.next()) {
    for (maquette::Predictor* const each : {&alone, first.get(), &second, &other_seed}) each->push(*frame);
    if (frame->desc().sequence == 1) first->sample(2, 1, 0.1);  // of another stream
  }
  for (maquette::Predictor* const each : {&alone, first.get(), &second, &other_seed}) each->sample(1, 2, 0.1);
  const std::vector<float> bits = alone.entropy_map(0, 2);
  EXPECT_EQ(second.entropy_map(0, 2), bits);
  EXPECT_EQ(first->entropy_map(0, 2), bits);
  EXPECT_NE(other_seed.entropy_map(0, 2), bits);
  first.reset();
  second.sample(1, 2, 0.1);
  EXPECT_EQ(second.entropy_map(0, 2), bits);
  const maquette::Predictor without(context_);
  maq_predictor* made = nullptr;
  config.shared_with = without.get();
  EXPECT_EQ(maq_predictor_create(context_.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text().find("config.shared_with has another method"), std::string::npos) << text();
  config.method = MAQ_PREDICTOR_AUTO;
  EXPECT_EQ(maq_predictor_create(context_.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text().find("no networks to share"), std::string::npos) << text();
  config.method = MAQ_PREDICTOR_SAMPLED;
  config.shared_with = reinterpret_cast<const maq_predictor*>(context_.get());
  EXPECT_EQ(maq_predictor_create(context_.get(), &config, &made), MAQ_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(text().find("config.shared_with is a maq_context"), std::string::npos) << text();
}

TEST_F(ApiPrediction, FramesThatWereNotSampledAreRefused) {
  maquette::Predictor predictor(context_, network_config(MAQ_PREDICTOR_SAMPLED)), automatic(context_);
  maq_frame* made = nullptr;
  std::vector<float> bits(256);
  const auto refused = [&](maq_status status, maq_status expected_status, const char* words) {
    EXPECT_EQ(status, expected_status) << words;
    EXPECT_NE(text().find(words), std::string::npos) << text();
    EXPECT_EQ(made, nullptr);
  };
  constexpr maq_status kWrong = MAQ_ERROR_INVALID_ARGUMENT;
  refused(maq_predictor_sample(predictor.get(), 1, 1, 0.1), kWrong, "No frame was pushed");
  for (maquette::Predictor* const each : {&predictor, &automatic}) each->push(frame(0));
  refused(maq_predictor_sample(automatic.get(), 1, 1, 0.1), MAQ_ERROR_UNSUPPORTED, "does not sample");
  refused(maq_predictor_acquire_sample(automatic.get(), 0, 1, &made), MAQ_ERROR_UNSUPPORTED, "does not sample");
  refused(maq_predictor_sample(predictor.get(), 0, 1, 0.1), kWrong, "sample_count is 0");
  refused(maq_predictor_sample(predictor.get(), 17, 1, 0.1), kWrong, "sample_count is 17");
  refused(maq_predictor_sample(predictor.get(), 1, 65, 0.1), kWrong, "frame_count is 65");
  for (const double step_s : {0.0, -0.1, 0.1251, std::nan(""), double(std::numeric_limits<float>::infinity())}) {
    refused(maq_predictor_sample(predictor.get(), 1, 1, step_s), kWrong, "step_s is");
  }
  refused(maq_predictor_acquire_sample(predictor.get(), 0, 1, &made), kWrong, "Frame 1 of sample 0 was asked for");
  predictor.sample(2, 3, 0.1);
  refused(maq_predictor_acquire_sample(predictor.get(), 2, 1, &made), kWrong, "3 frames (from 1) of 2 samples");
  refused(maq_predictor_acquire_sample(predictor.get(), 1, 0, &made), kWrong, "Frame 0");
  refused(maq_predictor_acquire_sample(predictor.get(), 1, 4, &made), kWrong, "Frame 4");
  refused(maq_predictor_acquire_sample(predictor.get(), 1, 3, nullptr), kWrong, "frame is NULL");
  refused(maq_predictor_copy_entropy_map(predictor.get(), 1, 3, bits.data(), 255), kWrong, "capacity is 255");
  refused(maq_predictor_copy_entropy_map(predictor.get(), 1, 3, nullptr, 256), kWrong, "bits is NULL");
  EXPECT_EQ(maq_predictor_copy_entropy_map(predictor.get(), 1, 3, bits.data(), 256), MAQ_OK);
  predictor.push(frame(1));
  refused(maq_predictor_acquire_sample(predictor.get(), 0, 1, &made), kWrong, "0 frames");
  predictor.sample(2, 3, 0.1);
  predictor.reset();
  refused(maq_predictor_copy_entropy_map(predictor.get(), 0, 1, bits.data(), 256), kWrong, "0 frames");
  EXPECT_EQ(maq_predictor_sample(nullptr, 1, 1, 0.1), kWrong);
}

TEST_F(ApiPrediction, ACancelledSamplingReturnsItsStatusAndTheNextOneRuns) {
  maquette::Predictor predictor(context_, network_config(MAQ_PREDICTOR_SAMPLED)), automatic(context_);
  maquette::Source source(context_, "stub:people?count=2&seed=3&size=320x240&fps=10&frames=3");
  while (const auto frame = source.next()) {
    predictor.push(*frame);
    automatic.push(*frame);
  }
  predictor.cancel();
  EXPECT_EQ(maq_predictor_sample(predictor.get(), 1, 1, 0.1), MAQ_CANCELLED);
  EXPECT_EQ(maq_predictor_sample(predictor.get(), 1, 1, 0.1), MAQ_OK);
  automatic.cancel();
  EXPECT_NO_THROW(automatic.predict(0.1)) << "only sampling is cancelled";
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

TEST_F(ApiPrediction, SavedImagesKeepTheMark) {
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
  config.model.threads = 1;
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
  predictor.reset();
  EXPECT_EQ(maq_predictor_predict(predictor.get(), 0.1, &made), MAQ_ERROR_INVALID_ARGUMENT) << "nothing is left";
  EXPECT_EQ(made, nullptr);
}

}  // namespace
