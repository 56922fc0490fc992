// Coming frames by networks: what torch expects, what stays as it is, and differences in every format.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "image/convert.h"
#include "prediction/networks/network_predictor.h"
#include "support/expect_error.h"
#include "support/samples/moving_texture.h"
#include "support/samples/tiny_transformer.h"

namespace {

std::shared_ptr<maq::ExpectedFrame> expected_frame(const std::string& bundle = tiny_transformer::kBundle) {
  return std::make_shared<maq::ExpectedFrame>(tiny_prediction::runtime(), maq::CodeBundle(maq::read_bundle(bundle)),
                                              maq::SessionSettings{});
}

std::shared_ptr<maq::MendedPicture> mended_picture(const std::string& bundle = tiny_transformer::kBundle) {
  return std::make_shared<maq::MendedPicture>(tiny_prediction::runtime(), maq::CodeBundle(maq::read_bundle(bundle)),
                                              maq::SessionSettings{});
}

maq::PredictionNetworks networks() {
  const maq::CodeBundle bundle(maq::read_bundle(tiny_transformer::kBundle));
  maq::PredictionNetworks all;
  all.encoder = tiny_prediction::encoder(tiny_transformer::kBundle);
  all.decoder = std::make_shared<maq::FrameDecoder>(tiny_prediction::runtime(), bundle, maq::SessionSettings{});
  all.mended = mended_picture();
  all.expected = expected_frame();
  all.transformer = tiny_transformer::open();
  return all;
}

constexpr maq::NetworkMode kModes[] = {maq::NetworkMode::kMended, maq::NetworkMode::kExpected,
                                       maq::NetworkMode::kDrawn};

maq::NetworkPredictor predictor(maq::NetworkMode mode) {
  maq::NetworkSettings settings;
  settings.mode = mode;
  return {networks(), settings, 1};
}

maq::Frame moving(int number, maq_pixel_format format = MAQ_PIXEL_BGR8) {
  return moving_texture::frame(format, 160, 120, 2 * number, number, number * tiny_prediction::kFrame_ns);
}

std::vector<uint8_t> packed_pixels(const maq::Frame& frame) {
  std::vector<uint8_t> pixels(maq::packed_bytes(frame.image.format, frame.image.width_px, frame.image.height_px));
  maq::copy_packed(frame.image, pixels.data());
  return pixels;
}

TEST(NetworkPredictor, TheExpectedFrameIsThatOfTorch) {
  const auto expected = expected_frame();
  ASSERT_TRUE(expected->has_motion());
  maq::ContextFrames frames = tiny_transformer::before(3).frames;
  frames[3] = tiny_transformer::codes(3);
  const std::vector<float> of_torch = tiny_transformer::floats_of("expected.f32");
  std::vector<float> found(of_torch.size());
  for (int again = 0; again < 2; ++again) {
    expected->run(frames, 0.1f, 0.4f, found.data());
    for (size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], of_torch[i], 1e-4) << i;
  }
  frames[3] = nullptr;
  expected->run(frames, 0.1f, 0.4f, found.data());
  EXPECT_NE(found, of_torch) << "without what motion foresees";
  const std::vector<float> before = found;
  expected->run(frames, 0.1f, 0.8f, found.data());
  EXPECT_NE(found, before) << "another time";
}

TEST(NetworkPredictor, TheMendedPictureIsThatOfTorch) {
  const auto mended = mended_picture();
  ASSERT_EQ(mended->before(), 3u);
  const std::vector<float> of_torch = tiny_transformer::floats_of("mended.f32");
  const std::string all = read_text(tiny_prediction::kFolder + "/frames.rgb");
  const auto* const first = reinterpret_cast<const uint8_t*>(all.data());
  constexpr size_t kPicture = 64 * 64 * 3;
  const uint8_t* frames[] = {first, first + kPicture, first + 2 * kPicture};
  std::vector<float> found(kPicture), other(kPicture);
  for (int again = 0; again < 2; ++again) {
    mended->run(frames, first + 3 * kPicture, 0.1f, 0.4f, found.data());
    for (size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], of_torch[i], 0.02) << i;
  }
  mended->run(frames, first + 3 * kPicture, 0.1f, 0.8f, other.data());
  EXPECT_NE(found, other) << "another time";
  frames[0] = nullptr;
  mended->run(frames, first + 3 * kPicture, 0.1f, 0.4f, found.data());
  frames[0] = frames[1];
  mended->run(frames, first + 3 * kPicture, 0.1f, 0.4f, other.data());
  EXPECT_EQ(found, other) << "the first is repeated";
}

TEST(NetworkPredictor, ItsPictureIsTheBaseAndWhatTheNetworksPictureDiffersFromTheirsOfIt) {
  for (const maq::NetworkMode mode : kModes) {
    maq::NetworkPredictor by_network = predictor(mode);
    maq::Predictor base({MAQ_PREDICTION_AUTO, 1});
    const maq::PredictionNetworks own = networks();
    maq::MotionCodes motion(own.encoder);
    std::vector<uint16_t> codes[4];
    std::vector<uint8_t> seen[4];
    for (int number = 0; number < 4; ++number) {
      const maq::Frame frame = tiny_prediction::frame(number);
      by_network.push(frame);
      base.push(frame);
      codes[number].resize(own.encoder->codes().count());
      seen[number].resize(64 * 64 * 3);
      own.encoder->run(frame.image, codes[number].data(), seen[number].data());
      motion.add(seen[number].data(), frame.timestamp_ns);
    }
    ASSERT_TRUE(base.moves());
    maq::Frame of_latent, of_base;
    by_network.predict(tiny_prediction::kFrame_ns, of_latent);
    base.predict(tiny_prediction::kFrame_ns, of_base);
    std::vector<float> made(64 * 64 * 3), of_theirs(made.size()), features(256 * 16);
    maq::CodesBefore before;
    for (size_t i = 0; i < 3; ++i) before.frames[i] = codes[i + 1].data();
    before.newest = codes[3].data();
    before.step_s = 0.1f;
    std::vector<uint16_t> found(codes[3].size());
    if (mode == maq::NetworkMode::kMended) {
      const uint8_t* const shown[] = {seen[1].data(), seen[2].data(), seen[3].data()};
      std::vector<uint8_t> squeezed(made.size());
      own.encoder->squeeze(of_base.image, squeezed.data());
      own.mended->run(shown, squeezed.data(), 0.1f, 0.1f, made.data());
      // What it changes, less half a level.
      for (size_t i = 0; i < made.size(); ++i) {
        const float change = made[i] - float(squeezed[i]);
        made[i] = change > 0.5f ? change - 0.5f : change < -0.5f ? change + 0.5f : 0.0f;
      }
    } else if (mode == maq::NetworkMode::kDrawn) {
      before.frames[3] = motion.at(4 * tiny_prediction::kFrame_ns, codes[3].data());
      own.transformer->draw({before}, {}, 4, 1, 0, found.data(), nullptr);
      own.decoder->picture(found.data(), made.data());
    } else {
      before.frames[3] = motion.at(4 * tiny_prediction::kFrame_ns, codes[3].data());
      own.expected->run(before.frames, 0.1f, 0.1f, features.data());
      own.decoder->picture(features.data(), made.data());
    }
    if (mode != maq::NetworkMode::kMended) {
      own.encoder->run(of_base.image, found.data());
      own.decoder->picture(found.data(), of_theirs.data());
    }
    const std::vector<uint8_t> from = packed_pixels(of_base), to = packed_pixels(of_latent);
    int changed = 0;
    for (size_t i = 0; i < to.size(); ++i) {
      const float sum = std::clamp(float(from[i]) + made[i] - of_theirs[i], 0.0f, 255.0f);
      ASSERT_NEAR(float(to[i]), sum, 0.51f) << i;
      changed += from[i] != to[i] ? 1 : 0;
    }
    EXPECT_GT(changed, 1000) << int(mode);
    EXPECT_EQ(by_network.steps(), mode == maq::NetworkMode::kDrawn ? 1u : 0u);
    EXPECT_GT(by_network.networks_ms(), 0);
    EXPECT_TRUE(of_latent.origin.is_predicted);
  }
}

TEST(NetworkPredictor, WhereNothingMovesItIsTheLastFrame) {
  for (const maq::NetworkMode mode : kModes) {
    maq::NetworkPredictor by_network = predictor(mode);
    maq::Frame shown = moving(0), predicted;
    for (int number = 0; number < 4; ++number) {
      shown.timestamp_ns = number * tiny_prediction::kFrame_ns;
      by_network.push(shown);
      for (const int64_t ahead_ns : {int64_t(0), tiny_prediction::kFrame_ns, 100 * tiny_prediction::kFrame_ns}) {
        by_network.predict(ahead_ns, predicted);
        EXPECT_EQ(packed_pixels(predicted), packed_pixels(shown));
        EXPECT_EQ(by_network.networks_ms(), 0);
      }
    }
  }
}

TEST(NetworkPredictor, EveryFormatIsChangedAlike) {
  maq::PictureDifference difference;
  maq::WorkerThreads threads(2);
  std::vector<float> change(8 * 8 * 3);
  for (size_t i = 0; i < change.size(); ++i) change[i] = float(i % 3) * 8 - 10 + 12 * float(i / 24) / 8;
  for (const auto format :
       {MAQ_PIXEL_RGB8, MAQ_PIXEL_BGR8, MAQ_PIXEL_RGBA8, MAQ_PIXEL_GREY8, MAQ_PIXEL_NV12, MAQ_PIXEL_YUYV}) {
    // Odd sizes too, and smaller than the difference.
    for (const auto& [width, height] : {std::pair{160, 120}, {33, 17}, {5, 3}, {1, 1}}) {
      maq::Frame frame = moving_texture::frame(format, width, height, 3, 1, 0);
      maq::Frame before = moving_texture::frame(format, width, height, 3, 1, 0);
      difference.add(change.data(), 8, frame.image, threads, frame.storage.data());
      std::vector<uint8_t> one(size_t(width) * size_t(height) * 3), other(one.size());
      maq::copy_pixels(before.image, MAQ_PIXEL_BGR8, one.data(), 0, one.size());
      maq::copy_pixels(frame.image, MAQ_PIXEL_BGR8, other.data(), 0, other.size());
      double error = 0;
      for (int y = 0; y < height; ++y) {
        const float at_y = std::clamp((float(y) + 0.5f) * 8 / float(height) - 0.5f, 0.0f, 7.0f);
        for (int x = 0; x < width; ++x) {
          float rgb[3] = {-10 + 12 * at_y / 8, -2 + 12 * at_y / 8, 6 + 12 * at_y / 8};
          if (format == MAQ_PIXEL_GREY8) {
            rgb[0] = rgb[1] = rgb[2] = 0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2];
          }
          for (int c = 0; c < 3; ++c) {
            const size_t i = (size_t(y) * size_t(width) + size_t(x)) * 3 + size_t(2 - c);
            const float sum = std::clamp(float(one[i]) + rgb[c], 0.0f, 255.0f);
            error += std::abs(double(float(other[i]) - sum)) / double(one.size());
          }
        }
      }
      EXPECT_LT(error, 1.6) << int(format) << " " << width;
    }
  }
}

TEST(NetworkPredictor, LessThanHalfALevelChangesNothingAndBytesDoNotOverflow) {
  maq::PictureDifference difference;
  maq::WorkerThreads threads(1);
  maq::Frame frame = moving(3), before = moving(3);
  const std::vector<float> little(64 * 64 * 3, 0.49f), much(64 * 64 * 3, 300.0f), less(64 * 64 * 3, -300.0f);
  difference.add(little.data(), 64, frame.image, threads, frame.storage.data());
  EXPECT_EQ(packed_pixels(frame), packed_pixels(before));
  difference.add(much.data(), 64, frame.image, threads, frame.storage.data());
  EXPECT_EQ(packed_pixels(frame), std::vector<uint8_t>(160 * 120 * 3, 255));
  difference.add(less.data(), 64, frame.image, threads, frame.storage.data());
  EXPECT_EQ(packed_pixels(frame), std::vector<uint8_t>(160 * 120 * 3, 0));
}

TEST(NetworkPredictor, NothingOfTheSceneBeforeACutOrAResetIsUsed) {
  for (const bool by_reset : {false, true}) {
    maq::NetworkPredictor by_network = predictor(maq::NetworkMode::kMended),
                          fresh = predictor(maq::NetworkMode::kMended);
    for (int number = 0; number < 5; ++number) by_network.push(moving(number));
    maq::Frame white = moving(5);
    std::fill(white.storage.begin(), white.storage.end(), uint8_t(255));
    if (by_reset) by_network.reset();
    by_network.push(white);
    fresh.push(white);
    for (int number = 6; number < 9; ++number) {
      const maq::Frame other =
          moving_texture::frame(MAQ_PIXEL_BGR8, 160, 120, 900 - 2 * number, 700, number * tiny_prediction::kFrame_ns);
      by_network.push(other);
      fresh.push(other);
      maq::Frame one, two;
      by_network.predict(tiny_prediction::kFrame_ns, one);
      fresh.predict(tiny_prediction::kFrame_ns, two);
      EXPECT_EQ(packed_pixels(one), packed_pixels(two)) << by_reset << " " << number;
    }
  }
}

TEST(NetworkPredictor, FramesFarAheadAreDrawnInSteps) {
  maq::NetworkPredictor by_network = predictor(maq::NetworkMode::kDrawn);
  for (int number = 0; number < 4; ++number) by_network.push(moving(number, MAQ_PIXEL_NV12));
  maq::Frame frame;
  for (const auto& [ahead_ns, steps] :
       {std::pair<int64_t, size_t>{33333333, 1}, {100000000, 1}, {100000001, 2}, {250000000, 3}}) {
    by_network.predict(ahead_ns, frame);
    EXPECT_EQ(by_network.steps(), steps);
  }
}

TEST(NetworkPredictor, ASampleGoesOnFromItsOwnFramesAndFromWhatMotionForeseesFromTheTrueOnes) {
  maq::NetworkSettings settings;
  settings.mode = maq::NetworkMode::kDrawn;
  settings.sampling.seed = 6;
  maq::NetworkPredictor by_network(networks(), settings, 1);
  const maq::PredictionNetworks own = networks();
  maq::MotionCodes motion(own.encoder);
  std::vector<uint16_t> seen[4];
  std::vector<uint8_t> squeezed(64 * 64 * 3);
  for (int number = 0; number < 4; ++number) {
    const maq::Frame frame = tiny_prediction::frame(number);
    by_network.push(frame);
    seen[number].resize(own.encoder->codes().count());
    own.encoder->run(frame.image, seen[number].data(), squeezed.data());
    motion.add(squeezed.data(), frame.timestamp_ns);
  }
  by_network.draw(2, 2, tiny_prediction::kFrame_ns);
  EXPECT_EQ(by_network.steps(), 4u);
  std::vector<uint16_t> drawn(2 * seen[3].size());
  std::vector<float> entropy(drawn.size()), found(256);
  std::vector<maq::CodesBefore> before(2);
  for (uint32_t number = 1; number <= 2; ++number) {
    const uint16_t* const moved = motion.at((3 + number) * tiny_prediction::kFrame_ns, seen[3].data());
    const std::vector<uint16_t> latest = drawn;
    for (size_t s = 0; s < 2; ++s) {
      const uint16_t* const last = number == 1 ? seen[3].data() : latest.data() + s * seen[3].size();
      before[s].frames = {seen[number].data(), seen[number + 1].data(), last, moved};
      before[s].newest = last;
      before[s].step_s = 0.1f;
    }
    own.transformer->draw(before, settings.sampling, 4, number, 0, drawn.data(), entropy.data());
    for (size_t s = 0; s < 2; ++s) {
      by_network.drawn_entropy(s, number, found.data());
      for (size_t place = 0; place < 256; ++place) {
        const float* const of_place = entropy.data() + s * seen[3].size() + 2 * place;
        ASSERT_NEAR(found[place], (of_place[0] + of_place[1]) / 2, 1e-6) << number << " " << s << " " << place;
      }
    }
  }
}

TEST(NetworkPredictor, BundlesWhoseNetworksAreNotWhatTheyShouldBeAreRefused) {
  TempFolder folder;
  std::filesystem::copy(tiny_transformer::kBundle, folder.path(), std::filesystem::copy_options::recursive);
  const auto manifest = nlohmann::json::parse(read_text(tiny_transformer::kBundle + "/manifest.json"));
  for (const std::string part : {"expected", "mended"}) {
    const auto refused = [&](const std::string& text, auto&& change) {
      nlohmann::json changed = manifest;
      change(changed);
      write_text(folder.file("manifest.json"), changed.dump());
      expect_error(MAQ_ERROR_BAD_BUNDLE, text.c_str(), [&] {
        part == "expected" ? void(expected_frame(folder.path().string()))
                           : void(mended_picture(folder.path().string()));
      });
    };
    for (const char* key : {"before", "max_ahead", "fps"}) {
      refused(key, [&](nlohmann::json& changed) { changed[part].erase(key); });
      refused(key, [&](nlohmann::json& changed) { changed[part][key] = 0; });
    }
    refused("fps", [&](nlohmann::json& changed) { changed[part]["fps"] = {30, 10}; });
    refused("graph " + part, [&](nlohmann::json& changed) {
      changed[part]["before"] = 4;
      changed[part]["frames"] = 5;
    });
    refused(part, [&](nlohmann::json& changed) { changed["graphs"].erase(part); });
    for (const char* side : {"inputs", "outputs"}) {
      refused("graph " + part, [&](nlohmann::json& changed) { changed["graphs"][part][side][0]["name"] = "x"; });
      refused("graph " + part, [&](nlohmann::json& changed) { changed["graphs"][part][side][0]["shape"][1] = 9; });
    }
  }
}

}  // namespace
