// How likely codes are by the transformer: what torch says, and extreme numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "prediction/transformer/code_likelihood.h"
#include "support/tiny_transformer.h"

namespace {

using tiny_transformer::before;
using tiny_transformer::codes;
using tiny_transformer::floats_of;
using tiny_transformer::kBundle;
using tiny_transformer::kCodes;

constexpr float kInfiniteLogit = std::numeric_limits<float>::infinity(),
                kNoLogit = std::numeric_limits<float>::quiet_NaN();

std::vector<float> bits_of(maq::CodeTransformer& transformer, int number) {
  std::vector<float> bits(kCodes);
  transformer.bits(before(number), codes(number), bits.data());
  return bits;
}

TEST(CodeTransformer, BitsAreThoseOfTorchAlsoWhereFramesBeforeAreUnseen) {
  const std::vector<float> expected = floats_of("foreseen.f32");
  for (const int threads : {1, 2}) {
    const auto transformer = tiny_transformer::open(kBundle, threads);
    for (int again = 0; again < 2; ++again) {
      for (int number = 1; number < tiny_prediction::kFrames; ++number) {
        const std::vector<float> found = bits_of(*transformer, number);
        for (size_t i = 0; i < kCodes; ++i) {
          ASSERT_NEAR(found[i], expected[size_t(number - 1) * kCodes + i], 1.5e-4) << number << " " << i;
        }
      }
    }
  }
}

TEST(CodeTransformer, ACodeChangesTheBitsOfThoseAfterItAndNoneBefore) {
  const auto transformer = tiny_transformer::open();
  const std::vector<float> whole = bits_of(*transformer, 3);
  std::vector<uint16_t> changed(codes(3), codes(3) + kCodes);
  constexpr size_t kAt = 2 * 100;  // the first slice of place 100
  changed[kAt] = uint16_t((changed[kAt] + 7) % 16);
  std::vector<float> found(kCodes);
  transformer->bits(before(3), changed.data(), found.data());
  for (size_t i = 0; i < kAt; ++i) ASSERT_EQ(found[i], whole[i]) << i;
  EXPECT_NE(found[kAt + 1], whole[kAt + 1]) << "the slice after it";
  EXPECT_NE(found[kAt + 2], whole[kAt + 2]) << "the place after it";
}

TEST(CodeTransformer, TheStepInTimeCountsWithinWhatItWasTrainedOn) {
  const auto transformer = tiny_transformer::open();
  const auto at = [&](float step_s) {
    maq::CodesBefore at_step = before(3);
    at_step.step_s = step_s;
    std::vector<float> bits(kCodes);
    transformer->bits(at_step, codes(3), bits.data());
    return bits;
  };
  EXPECT_NE(at(1 / 15.0f), at(1 / 25.0f));
  EXPECT_EQ(at(1 / 60.0f), at(1 / 30.0f));
  EXPECT_EQ(at(0), at(1 / 30.0f));
  EXPECT_EQ(at(1), at(0.1f));
}

TEST(CodeTransformer, StreamsOnSeveralThreadsDoNotDependOnEachOther) {
  const auto transformer = tiny_transformer::open();
  const std::vector<float> expected[2] = {bits_of(*transformer, 2), bits_of(*transformer, 5)};
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] {
      for (int i = 0; i < 10; ++i) EXPECT_EQ(bits_of(*transformer, k % 2 == 0 ? 2 : 5), expected[k % 2]);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST(CodeTransformer, BitsOfACodeAreThoseOfFloat64) {
  std::mt19937 random(5);
  for (const size_t entries : {1u, 2u, 7u, 16u, 33u, 512u}) {
    for (const float scale : {0.0f, 0.1f, 5.0f, 1e4f}) {
      std::normal_distribution<float> normal(0, 1);
      std::vector<float> logits(entries);
      for (float& logit : logits) logit = scale * normal(random);
      double largest = -1e30, sum = 0;
      for (const float logit : logits) largest = std::max(largest, double(logit));
      for (const float logit : logits) sum += std::exp(double(logit) - largest);
      for (size_t code = 0; code < entries; ++code) {
        const double bits = (std::log(sum) + largest - double(logits[code])) / std::log(2.0);
        const float found = maq::bits_of_code(logits.data(), entries, code);
        EXPECT_NEAR(double(found), std::min(bits, double(maq::kMaxCodeBits)), 2e-6 * (1 + bits))
            << entries << " " << scale;
      }
    }
  }
}

TEST(CodeTransformer, InfiniteLogitsAreStableAndNaNIsTold) {
  std::vector<float> logits(40, 0.5f);
  EXPECT_NEAR(maq::bits_of_code(logits.data(), 40, 3), std::log2(40.0f), 1e-5);
  logits[37] = -kInfiniteLogit;
  EXPECT_NEAR(maq::bits_of_code(logits.data(), 40, 3), std::log2(39.0f), 1e-5);
  EXPECT_EQ(maq::bits_of_code(logits.data(), 40, 37), maq::kMaxCodeBits);
  logits[5] = logits[39] = kInfiniteLogit;
  EXPECT_EQ(maq::bits_of_code(logits.data(), 40, 5), 1) << "one of two";
  EXPECT_EQ(maq::bits_of_code(logits.data(), 40, 3), maq::kMaxCodeBits);
  for (const size_t at : {0u, 20u, 39u}) {
    std::vector<float> with_nan = logits;
    with_nan[at] = kNoLogit;
    EXPECT_TRUE(std::isnan(maq::bits_of_code(with_nan.data(), 40, 5))) << at;
  }
  const std::vector<float> none(8, -kInfiniteLogit);
  EXPECT_EQ(maq::bits_of_code(none.data(), 8, 2), 3) << "all are equal";
}

}  // namespace
