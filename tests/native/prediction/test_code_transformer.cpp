// Probabilities of codes by the transformer: equal to torch, and extreme numbers.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "prediction/transformer/code_likelihood.h"
#include "support/samples/tiny_transformer.h"

namespace {

using tiny_transformer::before;
using tiny_transformer::codes;
using tiny_transformer::floats_of;
using tiny_transformer::kBundle;
using tiny_transformer::kCodes;

std::atomic<bool> never{false};  // not cancelled

constexpr float kInfiniteLogit = std::numeric_limits<float>::infinity(),
                kNoLogit = std::numeric_limits<float>::quiet_NaN();

std::vector<float> bits_of(maq::CodeTransformer& transformer, int number) {
  std::vector<float> bits(kCodes);
  transformer.bits(before(number), codes(number), bits.data());
  return bits;
}

TEST(CodeTransformer, BitsEqualTorchAlsoWithoutContextFrames) {
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
  constexpr size_t kAt = 2 * 100;  // the first group of cell 100
  changed[kAt] = uint16_t((changed[kAt] + 7) % 16);
  std::vector<float> found(kCodes);
  transformer->bits(before(3), changed.data(), found.data());
  for (size_t i = 0; i < kAt; ++i) ASSERT_EQ(found[i], whole[i]) << i;
  EXPECT_NE(found[kAt + 1], whole[kAt + 1]) << "the group after it";
  EXPECT_NE(found[kAt + 2], whole[kAt + 2]) << "the cell after it";
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

TEST(CodeTransformer, TheLikeliestCodesEqualPython) {
  const auto transformer = tiny_transformer::open();
  const std::string expected = read_text(tiny_transformer::kFolder + "/likeliest.u8");
  for (const size_t samples : {1u, 3u, 1u}) {
    std::vector<uint16_t> found(samples * kCodes);
    const std::vector<maq::CodesBefore> each(samples, before(3));
    transformer->sample(each, {0, 0}, 0, 0, never, found.data(), nullptr);
    for (size_t i = 0; i < found.size(); ++i) ASSERT_EQ(found[i], uint8_t(expected[i % kCodes])) << samples << " " << i;
  }
}

struct SampledCodes {
  std::vector<uint16_t> codes;
  std::vector<float> entropy;
};

// Sample by sample.
std::vector<SampledCodes> sampled_after(maq::CodeTransformer& transformer, const std::vector<maq::CodesBefore>& each,
                                        const maq::SamplingSettings& sampling, uint32_t frame = 1) {
  std::vector<uint16_t> codes(each.size() * kCodes);
  std::vector<float> entropy(codes.size());
  transformer.sample(each, sampling, 7, frame, never, codes.data(), entropy.data());
  std::vector<SampledCodes> found;
  for (auto at = std::ptrdiff_t(0); at < std::ptrdiff_t(codes.size()); at += std::ptrdiff_t(kCodes)) {
    const auto end = at + std::ptrdiff_t(kCodes);
    found.push_back({{codes.begin() + at, codes.begin() + end}, {entropy.begin() + at, entropy.begin() + end}});
  }
  return found;
}

TEST(CodeTransformer, ASampleDependsOnNoOtherAlsoWithOtherContexts) {
  const auto transformer = tiny_transformer::open();
  const maq::SamplingSettings sampling{1, 5};
  const std::vector<SampledCodes> alone = sampled_after(*transformer, {before(3)}, sampling),
                                  of_four = sampled_after(*transformer, {before(3), before(5), before(3), before(3)},
                                                          sampling),
                                  others = sampled_after(*transformer, {before(2), before(5), before(4)}, sampling);
  EXPECT_EQ(of_four[0].codes, alone[0].codes);
  EXPECT_EQ(of_four[1].codes, others[1].codes);
  EXPECT_NE(of_four[2].codes, of_four[0].codes) << "numbers of its own";
  EXPECT_NE(of_four[2].codes, of_four[3].codes);
  EXPECT_NE(others[0].codes, alone[0].codes) << "after other frames";
}

TEST(CodeTransformer, TheMeanBitsOfSamplesAreTheEntropy) {
  const auto transformer = tiny_transformer::open();
  double entropy = 0, bits = 0, squares = 0;
  std::vector<float> of_codes(kCodes);
  constexpr uint32_t kSampledCodess = 4;
  for (uint32_t frame = 0; frame < kSampledCodess; ++frame) {
    const std::vector<maq::CodesBefore> each(4, before(3));
    for (const SampledCodes& sampled : sampled_after(*transformer, each, {1, 2}, frame)) {
      transformer->bits(before(3), sampled.codes.data(), of_codes.data());
      for (size_t i = 0; i < kCodes; ++i) {
        entropy += double(sampled.entropy[i]);
        bits += double(of_codes[i]);
        squares += std::pow(double(of_codes[i] - sampled.entropy[i]), 2);
      }
    }
  }
  EXPECT_NEAR(bits, entropy, 5 * std::sqrt(squares)) << "of what is sampled one after another";
  EXPECT_GT(entropy / (4 * kSampledCodess * kCodes), 0.5);
}

TEST(CodeTransformer, SampledCodesHaveThePredictedBits) {
  const auto transformer = tiny_transformer::open();
  const std::vector<maq::CodesBefore> both(2, before(3));
  std::vector<uint16_t> sampled(2 * kCodes), again(2 * kCodes);
  std::vector<float> bits(kCodes);
  double total = 0;
  for (uint32_t frame = 0; frame < 4; ++frame) {
    transformer->sample(both, {1, 11}, 0, frame, never, sampled.data(), nullptr);
    transformer->sample(both, {1, 11}, 0, frame, never, again.data(), nullptr);
    EXPECT_EQ(sampled, again);
    EXPECT_FALSE(std::equal(sampled.begin(), sampled.begin() + kCodes, sampled.begin() + kCodes)) << "samples differ";
    for (size_t sample = 0; sample < 2; ++sample) {
      transformer->bits(before(3), sampled.data() + sample * kCodes, bits.data());
      for (const float of_code : bits) total += double(of_code) / (8 * kCodes);
    }
    transformer->sample(both, {1, 12}, 0, frame, never, again.data(), nullptr);
    EXPECT_NE(sampled, again) << "another seed";
  }
  // The mean of what is sampled is the entropy, which is near the bits of frames that were like those in training.
  double uniform = 0;
  std::vector<uint16_t> any(kCodes);
  std::mt19937 random(1);
  for (uint16_t& code : any) code = uint16_t(random() % 16);
  transformer->bits(before(3), any.data(), bits.data());
  for (const float of_code : bits) uniform += double(of_code) / kCodes;
  EXPECT_LT(total, 4) << "entropy";
  EXPECT_GT(uniform, total + 1) << "codes at random";
}

TEST(CodeTransformer, OldKeysAndValuesAreNotSeen) {
  const maq::TransformerBundle parts{maq::CodeBundle(maq::read_bundle(kBundle))};
  const maq::TransformerTables& tables = parts.tables;
  const std::vector<float> bias = maq::causal_bias(tables), expected = floats_of("foreseen.f32");
  const auto context = parts.context.open(tiny_prediction::runtime(), {});
  std::vector<float> summed(tables.cells() * tables.embedding);
  const float time_step = 0;  // log2 of 10 / fps
  const auto embedding = int64_t(tables.embedding), width = int64_t(tables.width);
  maq::DecodingSteps steps(tiny_prediction::runtime(), parts, bias, 1, {});
  for (int number = 1; number < 4; ++number) {
    steps.fill_kept(kNoLogit);
    steps.begin();
    maq::sum_context_embeddings(tables, before(number).frames, summed.data());
    const float* const seen =
        context->run({{summed.data(), {1, 256, embedding}}, {&time_step, {1, 1}}}, {{1, 256, width}})[0].data;
    for (size_t cell = 0; cell < 256; ++cell) {
      steps.run(cell, &seen);
      const uint16_t* const known = codes(number) + cell * tables.groups;
      for (size_t k = 0; k < tables.groups; ++k) {
        const float* const logits = steps.logits(k, &known);
        std::vector<float> with_prior(logits, logits + tables.entries);
        const size_t i = cell * tables.groups + k;
        const size_t row = k * tables.entries + before(number).newest[i];
        maq::add_stored_prior(parts.codes->bigram_bits.data() + row * tables.entries, tables.entries,
                              with_prior.data());
        ASSERT_NEAR(maq::bits_of_code(with_prior.data(), tables.entries, known[k]),
                    expected[size_t(number - 1) * kCodes + i], 1.5e-4)
            << number << " " << i;
      }
      steps.set(cell, &known);
    }
  }
}

TEST(CodeTransformer, BitsOfACodeEqualFloat64) {
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

TEST(CodeTransformer, EntropyEqualsFloat64) {
  std::mt19937 random(6);
  for (const size_t entries : {1u, 7u, 33u, 512u}) {
    for (const float scale : {0.0f, 0.1f, 5.0f, 1e4f}) {
      std::normal_distribution<float> normal(0, 1);
      std::vector<float> logits(entries);
      for (float& logit : logits) logit = scale * normal(random);
      const double largest = double(*std::max_element(logits.begin(), logits.end()));
      double sum = 0, bits = 0;
      for (const float logit : logits) sum += std::exp(double(logit) - largest);
      for (const float logit : logits) {
        const double below = double(logit) - largest;
        bits += std::exp(below) / sum * (std::log(sum) - below) / std::log(2.0);
      }
      EXPECT_NEAR(double(maq::entropy_bits(logits.data(), entries)), bits, 3e-5) << entries << " " << scale;
    }
  }
  std::vector<float> logits(8, -kInfiniteLogit);
  EXPECT_EQ(maq::entropy_bits(logits.data(), 8), 3) << "all are equal";
  logits[2] = logits[3] = 1;
  EXPECT_EQ(maq::entropy_bits(logits.data(), 8), 1) << "one of two";
  logits[4] = kInfiniteLogit;
  EXPECT_EQ(maq::entropy_bits(logits.data(), 8), 0);
  logits[5] = kNoLogit;
  EXPECT_TRUE(std::isnan(maq::entropy_bits(logits.data(), 8)));
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
