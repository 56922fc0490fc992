// The embedding file of a bundle (.maqr, docs/reference/formats.md): tables that are looked up around the transformer's
// graphs. Written by export/prediction/graphs/transformer_file.py.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace maq {

inline constexpr size_t kMaxContextFrames = 17;

// A row is the embedding of a code.
struct TransformerTables {
  size_t groups = 0, entries = 0, side = 0;  // as in FrameCodes
  size_t before = 0;                         // context frames of the stream
  size_t frames = 0;                         // inputs of the context network: `before`, or one more predicted by motion
  size_t embedding = 0, width = 0;           // numbers of a row, features of a cell
  size_t layers = 0, heads = 0;              // of the masked network
  std::vector<float> context_embeddings;     // [frames][groups][entries][embedding], the oldest frame first
  std::vector<float> group_embeddings;       // [groups][entries][embedding]: the frame itself
  // [entries][width] each: group 0 for group 1; 0 and 1 for 2; 0, 1 and 2 for 3; ...
  std::vector<std::vector<float>> earlier;
  // [layers][heads][2 * side - 1]: added to attention scores, by the distance in rows and in columns.
  std::vector<float> row_bias, column_bias;

  bool has_motion() const { return frames > before; }
  size_t cells() const { return side * side; }
  // Returns the rows of group `k` for the later group `of`.
  const std::vector<float>& earlier_embeddings(size_t of, size_t k) const { return earlier[of * (of - 1) / 2 + k]; }
};

// Reads hostile bytes safely: sizes are limited, and numbers are finite. `bytes` may be null when `count` is 0. `name`
// begins the error sentence. Throws MAQ_ERROR_BAD_BUNDLE for a truncated, damaged or other file, and
// MAQ_ERROR_UNSUPPORTED for another version.
TransformerTables read_embedding_file(const void* bytes, size_t count, const std::string& name);

}  // namespace maq
