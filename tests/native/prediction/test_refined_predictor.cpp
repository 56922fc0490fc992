// Refined prediction: the network of torch, its residual on the motion prediction, and what ends a stream.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "prediction/refine/refined_predictor.h"
#include "support/expect_error.h"
#include "support/samples/moving_texture.h"
#include "support/samples/tiny_transformer.h"

namespace {

std::shared_ptr<maq::ResidualRefiner> refiner(const std::string& bundle = tiny_transformer::kBundle) {
  return std::make_shared<maq::ResidualRefiner>(tiny_prediction::runtime(), maq::CodeBundle(maq::read_bundle(bundle)),
                                                maq::SessionSettings{});
}

maq::RefinerNetworks refiner_networks() { return {tiny_prediction::encoder(tiny_transformer::kBundle), refiner()}; }

maq::Frame moving_bgr(int number) {
  return moving_texture::frame(MAQ_PIXEL_BGR8, 160, 120, 2 * number, number, number * tiny_prediction::kFrame_ns);
}

std::vector<uint8_t> refined_pixels(const maq::Frame& frame) {
  std::vector<uint8_t> pixels(maq::packed_bytes(frame.image.format, frame.image.width_px, frame.image.height_px));
  maq::copy_packed(frame.image, pixels.data());
  return pixels;
}

TEST(RefinedPredictor, TheRefinedImageEqualsTorch) {
  const auto network = refiner();
  ASSERT_EQ(network->before(), 3u);
  const std::vector<float> of_torch = tiny_transformer::floats_of("mended.f32");
  const std::string all = read_text(tiny_prediction::kFolder + "/frames.rgb");
  const auto* const first = reinterpret_cast<const uint8_t*>(all.data());
  constexpr size_t kImage = 64 * 64 * 3;
  const uint8_t* frames[] = {first, first + kImage, first + 2 * kImage};
  std::vector<float> found(kImage), other(kImage);
  for (int again = 0; again < 2; ++again) {
    network->run(frames, first + 3 * kImage, 0.1f, 0.4f, found.data());
    for (size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], of_torch[i], 0.02) << i;
  }
  network->run(frames, first + 3 * kImage, 0.1f, 0.8f, other.data());
  EXPECT_NE(found, other) << "another time";
  frames[0] = nullptr;
  network->run(frames, first + 3 * kImage, 0.1f, 0.4f, found.data());
  frames[0] = frames[1];
  network->run(frames, first + 3 * kImage, 0.1f, 0.4f, other.data());
  EXPECT_EQ(found, other) << "the oldest frame is repeated";
}

TEST(RefinedPredictor, ItAddsTheResidualLessHalfALevelToTheMotionPrediction) {
  maq::RefinedPredictor predictor(refiner_networks(), {});
  maq::MotionPredictor base({maq::PredictionMethod::kAuto, 1});
  const maq::RefinerNetworks own = refiner_networks();
  std::vector<uint8_t> seen[4];
  for (int number = 0; number < 4; ++number) {
    const maq::Frame frame = tiny_prediction::frame(number);
    predictor.push(frame);
    base.push(frame);
    seen[number].resize(64 * 64 * 3);
    own.encoder->resize_to_input(frame.image, seen[number].data());
  }
  ASSERT_TRUE(base.moves());
  maq::Frame refined, moved;
  predictor.predict(tiny_prediction::kFrame_ns, refined);
  base.predict(tiny_prediction::kFrame_ns, moved);
  const uint8_t* const shown[] = {seen[1].data(), seen[2].data(), seen[3].data()};
  std::vector<uint8_t> input_rgb(64 * 64 * 3);
  std::vector<float> residual(input_rgb.size());
  own.encoder->resize_to_input(moved.image, input_rgb.data());
  own.refiner->run(shown, input_rgb.data(), 0.1f, 0.1f, residual.data());
  for (size_t i = 0; i < residual.size(); ++i) {
    const float change = residual[i] - float(input_rgb[i]);
    residual[i] = change > 0.5f ? change - 0.5f : change < -0.5f ? change + 0.5f : 0.0f;
  }
  const std::vector<uint8_t> from = refined_pixels(moved), to = refined_pixels(refined);
  int changed = 0;
  for (size_t i = 0; i < to.size(); ++i) {
    ASSERT_NEAR(float(to[i]), std::clamp(float(from[i]) + residual[i], 0.0f, 255.0f), 0.51f) << i;
    changed += from[i] != to[i] ? 1 : 0;
  }
  EXPECT_GT(changed, 1000);
  EXPECT_EQ(predictor.stats().method, maq::PredictionMethod::kRefined);
  EXPECT_GT(predictor.stats().networks_ms, 0);
  EXPECT_TRUE(refined.origin.is_predicted);
}

TEST(RefinedPredictor, WithoutMotionItIsTheLastFrame) {
  maq::RefinedPredictor predictor(refiner_networks(), {});
  maq::Frame shown = moving_bgr(0), predicted;
  for (int number = 0; number < 4; ++number) {
    shown.timestamp_ns = number * tiny_prediction::kFrame_ns;
    predictor.push(shown);
    for (const int64_t ahead_ns : {int64_t(0), tiny_prediction::kFrame_ns, 100 * tiny_prediction::kFrame_ns}) {
      predictor.predict(ahead_ns, predicted);
      EXPECT_EQ(refined_pixels(predicted), refined_pixels(shown));
      EXPECT_EQ(predictor.stats().networks_ms, 0);
      EXPECT_EQ(predictor.stats().method, maq::PredictionMethod::kLast);
    }
  }
}

TEST(RefinedPredictor, TheSceneBeforeACutOrAResetIsNotUsed) {
  for (const bool by_reset : {false, true}) {
    maq::RefinedPredictor predictor(refiner_networks(), {}), fresh(refiner_networks(), {});
    for (int number = 0; number < 5; ++number) predictor.push(moving_bgr(number));
    maq::Frame white = moving_bgr(5);
    std::fill(white.storage.begin(), white.storage.end(), uint8_t(255));
    if (by_reset) predictor.reset();
    predictor.push(white);
    fresh.push(white);
    for (int number = 6; number < 9; ++number) {
      const maq::Frame other =
          moving_texture::frame(MAQ_PIXEL_BGR8, 160, 120, 900 - 2 * number, 700, number * tiny_prediction::kFrame_ns);
      predictor.push(other);
      fresh.push(other);
      maq::Frame one, two;
      predictor.predict(tiny_prediction::kFrame_ns, one);
      fresh.predict(tiny_prediction::kFrame_ns, two);
      EXPECT_EQ(refined_pixels(one), refined_pixels(two)) << by_reset << " " << number;
    }
  }
}

TEST(RefinedPredictor, BundlesWithAnotherNetworkAreRefused) {
  TempFolder folder;
  std::filesystem::copy(tiny_transformer::kBundle, folder.path(), std::filesystem::copy_options::recursive);
  const auto manifest = nlohmann::json::parse(read_text(tiny_transformer::kBundle + "/manifest.json"));
  const auto refused = [&](const std::string& text, auto&& change) {
    nlohmann::json changed = manifest;
    change(changed);
    write_text(folder.file("manifest.json"), changed.dump());
    expect_error(MAQ_ERROR_BAD_BUNDLE, text.c_str(), [&] { refiner(folder.path().string()); });
  };
  for (const char* key : {"before", "max_ahead", "fps"}) {
    refused(key, [&](nlohmann::json& changed) { changed["mended"].erase(key); });
    refused(key, [&](nlohmann::json& changed) { changed["mended"][key] = 0; });
  }
  refused("fps", [&](nlohmann::json& changed) { changed["mended"]["fps"] = {30, 10}; });
  refused("graph mended", [&](nlohmann::json& changed) { changed["mended"]["before"] = 4; });
  refused("mended", [&](nlohmann::json& changed) { changed["graphs"].erase("mended"); });
  for (const char* side : {"inputs", "outputs"}) {
    refused("graph mended", [&](nlohmann::json& changed) { changed["graphs"]["mended"][side][0]["name"] = "x"; });
    refused("graph mended", [&](nlohmann::json& changed) { changed["graphs"]["mended"][side][0]["shape"][1] = 9; });
  }
}

}  // namespace
