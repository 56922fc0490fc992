// Codes as what the graphs of the transformer are given: sums of the rows that they stand for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/transformer/row_file.h"

namespace maq {

// Codes of frames before the one that is predicted, each [places][slices]: those of the stream, the oldest first, and
// where TransformerTables::has_motion() one made from motion. Null where none is known.
using ContextFrames = std::array<const uint16_t*, kMaxContextFrames>;

// The context network's input, [places][embedding].
void sum_context_rows(const TransformerTables& tables, const ContextFrames& frames, float* summed);

// Places that the slice network sees beside its kept keys and values: two rows above, three wide, and the left one.
inline constexpr size_t kNearCodes = 7;

// A frame that is made place after place, row by row.
class SliceRows {
 public:
  explicit SliceRows(const TransformerTables& tables);

  // Codes of a place, [slices]. A place is seen by those after it, whatever is set there later.
  void set(size_t place, const uint16_t* codes);
  // Of a place: [kNearCodes][embedding], zeros beyond the frame.
  void near(size_t place, float* near) const;

 private:
  // In the grid, which has two rows above and a place on either side.
  size_t at(size_t place) const { return (place / side_ + 2) * (side_ + 2) + place % side_ + 1; }

  const TransformerTables& tables_;
  const size_t side_;
  std::vector<float> grid_;  // [side + 2][side + 2][embedding]
};

// What the head of slice `of` is given of the slices before, whose codes are `codes` [of]: [width].
void sum_earlier_rows(const TransformerTables& tables, size_t of, const uint16_t* codes, float* sum);

// What the slice network adds to the score of a query and a key, [layers][heads][places][places]: -infinity for keys
// after the query.
std::vector<float> causal_bias(const TransformerTables& tables);

}  // namespace maq
