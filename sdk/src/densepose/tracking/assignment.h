// The assignment with the smallest total cost.
#pragma once

#include <vector>

namespace maq {

// No assignment: a cost that no pair of a sensible assignment has.
constexpr float kNoAssignment = 1e6f;

// Assigns each row to another column so that the sum of costs is smallest (Kuhn, "The Hungarian method", 1955; here by
// shortest augmenting paths). Pairs that cost kNoAssignment or more stay apart.
class Assignment {
 public:
  // `costs`: [rows, columns], finite. Returns the column of each row, -1 for none; valid until the next call. Takes
  // nothing from the heap once it has seen a matrix as large.
  const std::vector<int>& solve(const std::vector<float>& costs, int rows, int columns);

 private:
  void augment(int row);
  float cost(int row, int column) const;

  const float* costs_ = nullptr;
  int rows_ = 0, columns_ = 0, side_ = 0;
  std::vector<double> row_price_, column_price_, shortest_;
  std::vector<int> row_of_, before_, column_of_;
  std::vector<char> is_done_;
};

}  // namespace maq
