// Sampled prediction: decoding, steps, samples that continue from their own frames, and cancelling.
#include <gtest/gtest.h>

#include <algorithm>

#include "prediction/sampling/sampled_predictor.h"
#include "support/expect_error.h"
#include "support/samples/moving_texture.h"
#include "support/samples/tiny_transformer.h"

namespace {

maq::SamplerNetworks sampler_networks() {
  const maq::CodeBundle bundle(maq::read_bundle(tiny_transformer::kBundle));
  return {tiny_prediction::encoder(tiny_transformer::kBundle),
          std::make_shared<maq::FrameDecoder>(tiny_prediction::runtime(), bundle, maq::SessionSettings{}),
          tiny_transformer::open()};
}

maq::Frame moving_nv12(int number) {
  return moving_texture::frame(MAQ_PIXEL_NV12, 160, 120, 2 * number, number, number * tiny_prediction::kFrame_ns);
}

std::vector<uint8_t> sampled_pixels(const maq::Frame& frame) {
  std::vector<uint8_t> pixels(maq::packed_bytes(frame.image.format, frame.image.width_px, frame.image.height_px));
  maq::copy_packed(frame.image, pixels.data());
  return pixels;
}

// Pushes frames 0 to 3, and returns their codes.
std::array<std::vector<uint16_t>, 4> push_frames(maq::SampledPredictor& predictor, const maq::SamplerNetworks& own,
                                                 maq::MotionCodes& motion) {
  std::array<std::vector<uint16_t>, 4> codes;
  std::vector<uint8_t> input_rgb(64 * 64 * 3);
  for (int number = 0; number < 4; ++number) {
    const maq::Frame frame = tiny_prediction::frame(number);
    predictor.push(frame);
    codes[size_t(number)].resize(own.encoder->codes().count());
    own.encoder->encode(frame.image, codes[size_t(number)].data(), input_rgb.data());
    motion.add(input_rgb.data(), frame.timestamp_ns);
  }
  return codes;
}

TEST(SampledPredictor, ItAddsTheDifferenceOfTheDecodedSampleAndTheDecodedMotionPrediction) {
  const maq::SamplerNetworks own = sampler_networks();
  maq::SampledPredictor predictor(sampler_networks(), {}, {});
  maq::MotionPredictor base({maq::PredictionMethod::kAuto, 1});
  maq::MotionCodes motion(own.encoder);
  const auto codes = push_frames(predictor, own, motion);
  for (int number = 0; number < 4; ++number) base.push(tiny_prediction::frame(number));
  ASSERT_TRUE(base.moves());
  maq::Frame sampled, moved;
  predictor.predict(tiny_prediction::kFrame_ns, sampled);
  base.predict(tiny_prediction::kFrame_ns, moved);

  maq::CodesBefore before;
  for (size_t i = 0; i < 3; ++i) before.frames[i] = codes[i + 1].data();
  before.frames[3] = motion.at(4 * tiny_prediction::kFrame_ns, codes[3].data());
  before.newest = codes[3].data();
  before.step_s = 0.1f;
  std::vector<uint16_t> found(codes[3].size());
  std::vector<float> image(64 * 64 * 3), base_image(image.size());
  std::atomic<bool> cancel{false};
  own.transformer->sample({before}, {}, 4, 1, cancel, found.data(), nullptr);
  own.decoder->decode(found.data(), image.data());
  own.encoder->encode(moved.image, found.data());
  own.decoder->decode(found.data(), base_image.data());
  const std::vector<uint8_t> from = sampled_pixels(moved), to = sampled_pixels(sampled);
  int changed = 0;
  for (size_t i = 0; i < to.size(); ++i) {
    const float sum = std::clamp(float(from[i]) + image[i] - base_image[i], 0.0f, 255.0f);
    ASSERT_NEAR(float(to[i]), sum, 0.51f) << i;
    changed += from[i] != to[i] ? 1 : 0;
  }
  EXPECT_GT(changed, 1000);
  const maq::PredictorStats stats = predictor.stats();
  EXPECT_EQ(stats.method, maq::PredictionMethod::kSampled);
  EXPECT_EQ(stats.sampled_frames, 1u);
  EXPECT_EQ(stats.decoding_steps, 256u);
  EXPECT_GT(stats.networks_ms, 0);
  EXPECT_TRUE(sampled.origin.is_predicted);
}

TEST(SampledPredictor, FramesFarAheadAreSampledInSteps) {
  maq::SampledPredictor predictor(sampler_networks(), {}, {});
  for (int number = 0; number < 4; ++number) predictor.push(moving_nv12(number));
  maq::Frame frame;
  for (const auto& [ahead_ns, steps] :
       {std::pair<int64_t, size_t>{33333333, 1}, {100000000, 1}, {100000001, 2}, {250000000, 3}}) {
    predictor.predict(ahead_ns, frame);
    EXPECT_EQ(predictor.stats().sampled_frames, steps);
  }
}

TEST(SampledPredictor, ASampleContinuesFromItsOwnFramesAndTheMotionOfThePushedOnes) {
  maq::SamplingSettings sampling;
  sampling.seed = 6;
  const maq::SamplerNetworks own = sampler_networks();
  maq::SampledPredictor predictor(sampler_networks(), sampling, {});
  maq::MotionCodes motion(own.encoder);
  const auto seen = push_frames(predictor, own, motion);
  predictor.sample(2, 2, tiny_prediction::kFrame_ns);
  EXPECT_EQ(predictor.stats().sampled_frames, 4u);
  EXPECT_EQ(predictor.stats().decoding_steps, 2 * 256u);
  std::vector<uint16_t> sampled(2 * seen[3].size());
  std::vector<float> entropy(sampled.size()), found(256);
  std::vector<maq::CodesBefore> before(2);
  std::atomic<bool> cancel{false};
  for (uint32_t number = 1; number <= 2; ++number) {
    const uint16_t* const moved = motion.at((3 + number) * tiny_prediction::kFrame_ns, seen[3].data());
    const std::vector<uint16_t> latest = sampled;
    for (size_t s = 0; s < 2; ++s) {
      const uint16_t* const last = number == 1 ? seen[3].data() : latest.data() + s * seen[3].size();
      before[s].frames = {seen[number].data(), seen[number + 1].data(), last, moved};
      before[s].newest = last;
      before[s].step_s = 0.1f;
    }
    own.transformer->sample(before, sampling, 4, number, cancel, sampled.data(), entropy.data());
    for (size_t s = 0; s < 2; ++s) {
      predictor.copy_entropy(s, number, found.data());
      for (size_t cell = 0; cell < 256; ++cell) {
        const float* const of_cell = entropy.data() + s * seen[3].size() + 2 * cell;
        ASSERT_NEAR(found[cell], (of_cell[0] + of_cell[1]) / 2, 1e-6) << number << " " << s << " " << cell;
      }
    }
  }
}

TEST(SampledPredictor, WithoutMotionItIsTheLastFrame) {
  maq::SampledPredictor predictor(sampler_networks(), {}, {});
  maq::Frame shown = moving_nv12(0), predicted;
  for (int number = 0; number < 3; ++number) {
    shown.timestamp_ns = number * tiny_prediction::kFrame_ns;
    predictor.push(shown);
    for (const int64_t ahead_ns : {int64_t(0), tiny_prediction::kFrame_ns, 100 * tiny_prediction::kFrame_ns}) {
      predictor.predict(ahead_ns, predicted);
      EXPECT_EQ(sampled_pixels(predicted), sampled_pixels(shown));
      EXPECT_EQ(predictor.stats().networks_ms, 0);
      EXPECT_EQ(predictor.stats().method, maq::PredictionMethod::kLast);
    }
  }
}

}  // namespace
