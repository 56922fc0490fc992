// Batches of the field engine on several threads.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <stdexcept>

#include "head/field/field_parts.h"
#include "head/reference_field.h"
#include "support/expect_error.h"

namespace field_parts {
namespace {

using namespace maq::head;        // NOLINT
using namespace reference_field;  // NOLINT

FieldShape small_shape() {
  FieldShape shape;
  shape.width = shape.surface_width = 16;
  return shape;
}

TEST(FieldParts, EachItemIsInOnePartAndPartsAreWhole) {
  for (const int count : {1, 2, 3, 7}) {
    maq::WorkerThreads threads(2);
    FieldParts parts(small_shape(), count);
    for (const size_t items : {0u, 1u, 63u, 64u, 65u, 1000u}) {
      for (const size_t whole : {0u, 1u, 64u}) {
        std::vector<std::atomic<int>> seen(items);
        parts.run(threads, items, whole, [&](FieldParts::Part& part) {
          for (size_t i = part.begin; i < part.end; ++i) ++seen[i];
        });
        for (const std::atomic<int>& times : seen) ASSERT_EQ(times, 1);
        size_t end = 0;
        for (int i = 0; i < count; ++i) {
          EXPECT_EQ(parts.part(i).begin, end);
          end = parts.part(i).end;
          if (whole > 0 && end < items) {
            EXPECT_EQ(end % whole, 0u);
          }
        }
        EXPECT_EQ(end, items);
      }
    }
  }
}

TEST(FieldParts, GradientsHaveTheSameBitsWhateverTheThreads) {
  const FieldWeights weights = random_weights(small_shape(), 41);
  FieldEngine engine(weights.shape());
  engine.set_weights(weights);
  const Columns columns = random_columns(1000, 42, 2.2f);
  const std::vector<float> by_distance = random_columns(1000, 43, 1.0f)[0];
  std::vector<FieldWeights> sums;
  for (const int count : {1, 2, 2, 4}) {
    maq::WorkerThreads threads(count);
    FieldParts parts(weights.shape(), 2);
    FieldWeights sum(weights.shape());
    for (int round = 0; round < 2; ++round) {
      parts.run(threads, columns[0].size(), 64, [&](FieldParts::Part& part) {
        const size_t begin = part.begin;
        std::vector<float> distance(part.end - begin);
        engine.forward({&columns[0][begin], &columns[1][begin], &columns[2][begin], distance.size()}, part.workspace,
                       {distance.data(), {}, {}, {}});
        engine.backward(part.workspace, {&by_distance[begin], {}, {}}, WeightGradient::kAll, &part.gradient);
      });
    }
    parts.add_gradients(sum);
    sums.push_back(sum);
  }
  for (const FieldWeights& sum : sums) {
    EXPECT_EQ(std::memcmp(sum.values().data(), sums[0].values().data(), sum.values().size() * 4), 0);
  }
  const Gradients expected =
      gradients(weights, columns, false, [&](size_t i) { return std::array<double, 10>{double(by_distance[i])}; });
  for (size_t layer = 0; layer < expected.weights.size(); ++layer) {
    EXPECT_LE(relative_error(as_lists(sums[0])[layer], expected.weights[layer]), 1e-4) << layer;
  }
}

TEST(FieldParts, WhatAPartThrowsIsThrownAndCountsAreChecked) {
  maq::WorkerThreads threads(2);
  FieldParts parts(small_shape(), 2);
  EXPECT_THROW(parts.run(threads, 10, 1, [](FieldParts::Part&) { throw std::runtime_error("part"); }),
               std::runtime_error);
  for (const int count : {0, -1, maq::kMaxThreads + 1}) {
    expect_error(MAQ_ERROR_INVALID_ARGUMENT, "Parts", [&] { FieldParts(small_shape(), count); });
  }
}

}  // namespace
}  // namespace field_parts
