#include "densepose/tracking/assignment.h"

#include <algorithm>
#include <limits>

namespace maq {

// The matrix is square with the rows and columns that are missing, which pair with anything at kNoAssignment.
float Assignment::cost(int row, int column) const {
  if (row >= rows_ || column >= columns_) return kNoAssignment;
  return std::min(costs_[size_t(row) * size_t(columns_) + size_t(column)], kNoAssignment);
}

const std::vector<int>& Assignment::solve(const std::vector<float>& costs, int rows, int columns) {
  costs_ = costs.data();
  rows_ = rows;
  columns_ = columns;
  side_ = std::max(rows, columns);
  const size_t size = size_t(side_) + 1;  // index 0 is the row or column that is being assigned
  row_price_.assign(size, 0);
  column_price_.assign(size, 0);
  row_of_.assign(size, 0);
  before_.assign(size, 0);
  for (int row = 1; row <= side_; ++row) augment(row);
  column_of_.assign(size_t(rows), -1);
  for (int column = 1; column <= columns; ++column) {
    const int row = row_of_[size_t(column)];
    if (row <= rows && cost(row - 1, column - 1) < kNoAssignment) column_of_[size_t(row - 1)] = column - 1;
  }
  return column_of_;
}

// Assigns one more row: the cheapest path of reassignments from it to a free column.
void Assignment::augment(int row) {
  row_of_[0] = row;
  shortest_.assign(size_t(side_) + 1, std::numeric_limits<double>::max());
  is_done_.assign(size_t(side_) + 1, 0);
  int column = 0;
  do {
    is_done_[size_t(column)] = 1;
    const int at = row_of_[size_t(column)];
    double step = std::numeric_limits<double>::max();
    int next = 0;
    for (int c = 1; c <= side_; ++c) {
      if (is_done_[size_t(c)] != 0) continue;
      const double reduced = double(cost(at - 1, c - 1)) - row_price_[size_t(at)] - column_price_[size_t(c)];
      if (reduced < shortest_[size_t(c)]) {
        shortest_[size_t(c)] = reduced;
        before_[size_t(c)] = column;
      }
      if (shortest_[size_t(c)] < step) {
        step = shortest_[size_t(c)];
        next = c;
      }
    }
    for (int c = 0; c <= side_; ++c) {
      if (is_done_[size_t(c)] != 0) {
        row_price_[size_t(row_of_[size_t(c)])] += step;
        column_price_[size_t(c)] -= step;
      } else {
        shortest_[size_t(c)] -= step;
      }
    }
    column = next;
  } while (row_of_[size_t(column)] != 0);
  while (column != 0) {
    const int from = before_[size_t(column)];
    row_of_[size_t(column)] = row_of_[size_t(from)];
    column = from;
  }
}

}  // namespace maq
