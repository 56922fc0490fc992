// Nearest entries: against float64, ties, NaN.
#include "prediction/codec/nearest_entry.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace {

maq::FrameCodes random_codes(size_t groups, size_t entries, size_t width, size_t side, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  maq::FrameCodes codes;
  codes.groups = groups, codes.entries = entries, codes.width = width, codes.side = side;
  codes.vectors.resize(groups * entries * width);
  for (float& value : codes.vectors) value = normal(random);
  return codes;
}

TEST(NearestEntry, IsThatOfFloat64ForEverySize) {
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  for (const std::array<size_t, 4>& sizes :
       {std::array<size_t, 4>{4, 512, 32, 16}, {1, 1, 1, 1}, {3, 17, 5, 2}, {2, 15, 7, 3}, {1, 1024, 2, 5}}) {
    const size_t groups = sizes[0], entries = sizes[1], width = sizes[2];
    const maq::FrameCodes codes = random_codes(groups, entries, width, sizes[3], 3);
    std::vector<float> features(codes.cells() * groups * width);
    for (float& value : features) value = normal(random);
    std::vector<uint16_t> found(codes.count());
    maq::NearestEntry(codes).run(features.data(), codes.cells(), found.data());
    for (size_t cell = 0; cell < codes.cells(); ++cell) {
      for (size_t group = 0; group < groups; ++group) {
        const auto distance = [&](size_t entry) {
          double sum = 0;
          for (size_t i = 0; i < width; ++i) {
            const double difference = double(features[(cell * groups + group) * width + i]) -
                                      double(codes.vectors[(group * entries + entry) * width + i]);
            sum += difference * difference;
          }
          return sum;
        };
        double least = std::numeric_limits<double>::infinity();
        for (size_t entry = 0; entry < entries; ++entry) least = std::min(least, distance(entry));
        EXPECT_LE(distance(found[cell * groups + group]), least + 1e-5) << cell << " " << group;
      }
    }
  }
}

TEST(NearestEntry, IsTheLowestOfEqualsAndOfNumbersThatAreNone) {
  maq::FrameCodes codes = random_codes(1, 40, 4, 2, 5);
  for (const size_t copy : {6u, 21u, 39u}) std::copy_n(codes.vectors.data() + 12, 4, codes.vectors.data() + 4 * copy);
  std::vector<float> features(16);
  std::copy_n(codes.vectors.data() + 12, 4, features.data());
  features[4] = std::numeric_limits<float>::quiet_NaN();
  features[8] = std::numeric_limits<float>::infinity();
  std::vector<uint16_t> found(4, 99);
  maq::NearestEntry(codes).run(features.data(), 4, found.data());
  EXPECT_EQ(found[0], 3);
  EXPECT_EQ(found[1], 0);
  EXPECT_LT(found[2], 40);
  std::fill(codes.vectors.begin(), codes.vectors.end(), 0.0f);
  maq::NearestEntry(codes).run(features.data(), 1, found.data());
  EXPECT_EQ(found[0], 0) << "all are equal";
}

}  // namespace
