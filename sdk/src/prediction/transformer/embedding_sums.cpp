#include "prediction/transformer/embedding_sums.h"

#include <algorithm>
#include <limits>

#include "core/simd_clones.h"

namespace maq {
namespace {

MAQ_SIMD_CLONES void add_row(const float* row, size_t count, float* sum) {
  for (size_t i = 0; i < count; ++i) sum[i] += row[i];
}

}  // namespace

void sum_context_embeddings(const TransformerTables& tables, const ContextFrames& frames, float* summed) {
  const size_t embedding = tables.embedding;
  std::fill_n(summed, tables.cells() * embedding, 0.0f);
  for (size_t frame = 0; frame < tables.frames; ++frame) {
    if (frames[frame] == nullptr) continue;
    for (size_t i = 0; i < tables.cells() * tables.groups; ++i) {
      const size_t group = frame * tables.groups + i % tables.groups;
      const size_t row = group * tables.entries + frames[frame][i];
      add_row(tables.context_embeddings.data() + row * embedding, embedding, summed + i / tables.groups * embedding);
    }
  }
}

GroupEmbeddings::GroupEmbeddings(const TransformerTables& tables)
    : tables_(tables), side_(tables.side), grid_((side_ + 2) * (side_ + 2) * tables.embedding, 0.0f) {}

void GroupEmbeddings::set(size_t cell, const uint16_t* codes) {
  const size_t embedding = tables_.embedding;
  float* const sum = grid_.data() + at(cell) * embedding;
  std::fill_n(sum, embedding, 0.0f);
  for (size_t group = 0; group < tables_.groups; ++group) {
    add_row(tables_.group_embeddings.data() + (group * tables_.entries + codes[group]) * embedding, embedding, sum);
  }
}

void GroupEmbeddings::near(size_t cell, float* near) const {
  const size_t embedding = tables_.embedding, up = side_ + 2, here = at(cell);
  const size_t neighbours[kNearCodes] = {here - 2 * up - 1, here - 2 * up, here - 2 * up + 1, here - up - 1,
                                         here - up,         here - up + 1, here - 1};
  for (const size_t neighbour : neighbours) near = std::copy_n(grid_.data() + neighbour * embedding, embedding, near);
}

void sum_earlier_embeddings(const TransformerTables& tables, size_t of, const uint16_t* codes, float* sum) {
  std::fill_n(sum, tables.width, 0.0f);
  for (size_t k = 0; k < of; ++k) {
    add_row(tables.earlier_embeddings(of, k).data() + codes[k] * tables.width, tables.width, sum);
  }
}

std::vector<float> causal_bias(const TransformerTables& tables) {
  const size_t side = tables.side, cells = tables.cells(), steps = 2 * side - 1;
  std::vector<float> bias(tables.layers * tables.heads * cells * cells, -std::numeric_limits<float>::infinity());
  float* to = bias.data();
  for (size_t head = 0; head < tables.layers * tables.heads; ++head) {
    const float *rows = tables.row_bias.data() + head * steps, *columns = tables.column_bias.data() + head * steps;
    for (size_t query = 0; query < cells; ++query, to += cells) {
      for (size_t key = 0; key <= query; ++key) {
        const size_t down = query / side - key / side + side - 1, right = query % side + side - 1 - key % side;
        to[key] = rows[down] + columns[right];
      }
    }
  }
  return bias;
}

}  // namespace maq
