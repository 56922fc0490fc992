// The assignment with the smallest total cost.
#include "densepose/tracking/assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace {

float total(const std::vector<float>& costs, int columns, const std::vector<int>& column_of) {
  float sum = 0;
  for (size_t row = 0; row < column_of.size(); ++row) {
    if (column_of[row] >= 0) sum += costs[row * size_t(columns) + size_t(column_of[row])];
  }
  return sum;
}

TEST(Assignment, IsTheBestOfAllPermutations) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> cost(0, 10);
  maq::Assignment assignment;
  for (const auto& [rows, columns] : {std::pair{1, 1}, {3, 3}, {5, 5}, {2, 5}, {5, 2}, {6, 6}}) {
    std::vector<float> costs(size_t(rows * columns));
    std::generate(costs.begin(), costs.end(), [&] { return cost(random); });
    const std::vector<int> found = assignment.solve(costs, rows, columns);
    ASSERT_EQ(found.size(), size_t(rows));
    EXPECT_EQ(std::count(found.begin(), found.end(), -1), std::max(0, rows - columns));
    // Every injective choice, by permutations of the longer side.
    std::vector<int> order(size_t(std::max(rows, columns)));
    std::iota(order.begin(), order.end(), 0);
    float best = 1e9f;
    do {
      std::vector<int> choice(size_t(rows), -1);
      if (rows <= columns) {
        std::copy_n(order.begin(), rows, choice.begin());
      } else {
        for (int column = 0; column < columns; ++column) choice[size_t(order[size_t(column)])] = column;
      }
      best = std::min(best, total(costs, columns, choice));
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_NEAR(total(costs, columns, found), best, 1e-4f) << rows << " " << columns;
  }
}

TEST(Assignment, PairsThatAreNotAllowedStayApartAndTheOthersDoNotLoseByIt) {
  constexpr float kNone = maq::kNoAssignment;
  maq::Assignment assignment;
  EXPECT_EQ(assignment.solve({kNone, 1, kNone, 5}, 2, 2), (std::vector<int>{1, -1}));
  EXPECT_EQ(assignment.solve({1, 2, 1.5f, kNone}, 2, 2), (std::vector<int>{1, 0}));
  EXPECT_EQ(assignment.solve({kNone, kNone}, 1, 2), (std::vector<int>{-1}));
}

TEST(Assignment, NothingToAssign) {
  maq::Assignment assignment;
  EXPECT_TRUE(assignment.solve({}, 0, 0).empty());
  EXPECT_TRUE(assignment.solve({}, 0, 3).empty());
  EXPECT_EQ(assignment.solve({}, 2, 0), (std::vector<int>{-1, -1}));
}

}  // namespace
