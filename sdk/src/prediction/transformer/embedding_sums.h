// Inputs of the transformer's graphs: sums of the embeddings of codes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prediction/transformer/embedding_file.h"

namespace maq {

// Codes of the context frames, [cells][groups] each: the stream's, the oldest first, then the motion prediction with
// TransformerTables::has_motion(). Null for a missing frame.
using ContextFrames = std::array<const uint16_t*, kMaxContextFrames>;

// Computes the context network's input, [cells][embedding].
void sum_context_embeddings(const TransformerTables& tables, const ContextFrames& frames, float* summed);

// Neighbour cells that the masked network sees directly: three in each of the two rows above, and the left one.
inline constexpr size_t kNearCodes = 7;

// Sums of a frame that is decoded cell after cell, row by row.
class GroupEmbeddings {
 public:
  explicit GroupEmbeddings(const TransformerTables& tables);

  // Sets the codes of a cell, [groups].
  void set(size_t cell, const uint16_t* codes);
  // Writes the sums of the cell's neighbours, [kNearCodes][embedding], zeros outside the frame.
  void near(size_t cell, float* near) const;

 private:
  // Index in the grid, which has two more rows above and one more cell on either side.
  size_t at(size_t cell) const { return (cell / side_ + 2) * (side_ + 2) + cell % side_ + 1; }

  const TransformerTables& tables_;
  const size_t side_;
  std::vector<float> grid_;  // [side + 2][side + 2][embedding]
};

// Sums the embeddings of the groups before `of`, whose codes are `codes` [of]: [width], an input of the head of `of`.
void sum_earlier_embeddings(const TransformerTables& tables, size_t of, const uint16_t* codes, float* sum);

// Returns the masked network's attention bias, [layers][heads][cells][cells]: -infinity for keys after the query.
std::vector<float> causal_bias(const TransformerTables& tables);

}  // namespace maq
