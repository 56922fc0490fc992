// Sampled codes: random numbers, frequencies, extremes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "prediction/transformer/code_sampler.h"
#include "prediction/transformer/philox.h"
#include "support/expect_error.h"

namespace {

constexpr float kForEver = std::numeric_limits<float>::infinity(),
                kNotANumber = std::numeric_limits<float>::quiet_NaN();

maq::SamplePosition position_of(size_t number) {
  maq::SamplePosition position;
  position.cell = uint32_t(number % 256);
  position.frame = uint32_t(number / 256);
  return position;
}

// Counts the samples of each code.
std::vector<int> counts_of(const maq::SamplingSettings& settings, const std::vector<float>& logits, size_t count) {
  maq::CodeSampler sampler(settings, logits.size());
  std::vector<int> counts(logits.size());
  for (size_t i = 0; i < count; ++i) ++counts[sampler.sample(logits.data(), position_of(i))];
  return counts;
}

uint16_t sampled(const maq::SamplingSettings& settings, const std::vector<float>& logits) {
  return maq::CodeSampler(settings, logits.size()).sample(logits.data(), {});
}

// Chi-square of counts against probabilities; of n codes it is n - 1 +- sqrt(2 n).
double chi_square(const std::vector<int>& counts, const std::vector<double>& probabilities) {
  const double count = std::accumulate(counts.begin(), counts.end(), 0.0);
  double sum = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    const double expected = count * probabilities[i];
    sum += expected > 0 ? std::pow(counts[i] - expected, 2) / expected : counts[i] * 1e9;
  }
  return sum;
}

std::vector<double> softmax(const std::vector<float>& logits, double temperature) {
  std::vector<double> weights;
  for (const float logit : logits) weights.push_back(std::exp(double(logit) / temperature));
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& weight : weights) weight /= sum;
  return weights;
}

std::vector<float> random_logits(size_t entries, float scale) {
  std::mt19937 random(9);
  std::normal_distribution<float> normal(0, scale);
  std::vector<float> logits(entries);
  for (float& logit : logits) logit = normal(random);
  return logits;
}

TEST(CodeSampler, PhiloxGivesTheNumbersOfItsAuthors) {
  // Random123, kat_vectors: philox4x32 10.
  using Words = std::array<uint32_t, 4>;
  EXPECT_EQ(maq::philox({0, 0, 0, 0}, 0), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(maq::philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, 0xffffffffffffffff),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(maq::philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, 0x299f31d0a4093822),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(CodeSampler, CodesAreDrawnAsOftenAsTheirLogitsSay) {
  const std::vector<float> logits = random_logits(32, 1.5f);
  for (const float temperature : {0.5f, 1.0f, 2.0f}) {
    maq::SamplingSettings settings;
    settings.temperature = temperature;
    settings.seed = 3;
    EXPECT_LT(chi_square(counts_of(settings, logits, 100000), softmax(logits, double(temperature))), 31 + 5 * 8.0)
        << temperature;
  }
}

TEST(CodeSampler, AtInfiniteTemperatureAllAreEquallyLikely) {
  for (const float temperature : {1e6f, kForEver}) {
    maq::SamplingSettings settings;
    settings.temperature = temperature;
    const std::vector<int> counts = counts_of(settings, random_logits(512, 10), 200000);
    EXPECT_LT(chi_square(counts, std::vector<double>(512, 1 / 512.0)), 511 + 5 * 32.0) << temperature;
  }
}

TEST(CodeSampler, AtTemperature0ItIsTheLikeliestTheLowestOfEquals) {
  const std::vector<float> logits{0, 3, -1, 3, 2.9f};
  for (uint64_t seed = 0; seed < 50; ++seed) {
    EXPECT_EQ(sampled({0, seed}, logits), 1);
    EXPECT_EQ(sampled({1e-6f, seed}, {0, 2, 3, 2.9f}), 2);
    EXPECT_EQ(sampled({0, seed}, std::vector<float>(7, 1.0f)), 0);
  }
}

TEST(CodeSampler, HugeAndInfiniteLogitsAreStableAndNaNIsTold) {
  EXPECT_EQ(sampled({}, {-1e4f, 1e4f, 0}), 1);
  EXPECT_EQ(sampled({}, {3, kForEver, 1e30f}), 1);
  EXPECT_EQ(sampled({kForEver, 0}, {3, kForEver, 1e30f}), 1);
  const std::vector<int> of_two = counts_of({}, {kForEver, 5, kForEver}, 10000);
  EXPECT_LT(chi_square(of_two, {0.5, 0, 0.5}), 20);
  const std::vector<int> without = counts_of({kForEver, 0}, {1, -kForEver, 2, -kForEver}, 10000);
  EXPECT_LT(chi_square(without, {0.5, 0, 0.5, 0}), 20);
  const std::vector<int> of_none = counts_of({}, std::vector<float>(4, -kForEver), 10000);
  EXPECT_LT(chi_square(of_none, std::vector<double>(4, 0.25)), 25);
  for (const float temperature : {0.0f, 1.0f, kForEver}) {
    expect_error(MAQ_ERROR_INFERENCE, "NaN", [&] { sampled({temperature, 0}, {1, 2, kNotANumber}); });
  }
}

TEST(CodeSampler, EveryPositionAndSeedHasANumberOfItsOwn) {
  const std::vector<float> even(512, 0.0f);
  maq::CodeSampler sampler({}, 512);
  const uint16_t first = sampler.sample(even.data(), {});
  EXPECT_EQ(sampler.sample(even.data(), {}), first);
  int equal = 0;
  for (int i = 1; i <= 100; ++i) {
    maq::SamplePosition changed[5];
    changed[0].stream = changed[1].frame = uint32_t(i);
    changed[2].sample = changed[3].group = uint16_t(i);
    changed[4].cell = uint32_t(i);
    for (const maq::SamplePosition& position : changed) equal += sampler.sample(even.data(), position) == first ? 1 : 0;
    maq::CodeSampler other({1, uint64_t(i) << 32}, 512);
    equal += other.sample(even.data(), {}) == first ? 1 : 0;
  }
  EXPECT_LE(equal, 8) << "of 600; one of 512 by chance";
}

TEST(CodeSampler, SettingsOutOfRangeAreRefused) {
  for (const float temperature : {-1.0f, -kForEver, kNotANumber}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "temperature", [&] { maq::CodeSampler({temperature, 0}, 512); });
  }
}

}  // namespace
