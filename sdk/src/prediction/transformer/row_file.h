// What is looked up around the graphs of the transformer, in a file of a bundle (.maqr, docs/formats.md). Written by
// export/prediction/graphs/transformer_file.py.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace maq {

inline constexpr size_t kMaxContextFrames = 17;

// A row is what a code stands for.
struct TransformerTables {
  size_t slices = 0, entries = 0, side = 0;  // as of FrameCodes
  size_t before = 0;                         // frames of the stream that are seen
  size_t frames = 0;                         // given to the context network: `before`, or one more, made from motion
  size_t embedding = 0, width = 0;           // numbers of a row, and of features of a place
  size_t layers = 0, heads = 0;              // of the slice network
  std::vector<float> context_rows;           // [frames][slices][entries][embedding], the oldest frame first
  std::vector<float> slice_rows;             // [slices][entries][embedding]: of the frame itself
  // [entries][width] of slice 0 for slice 1, of 0 and 1 for 2, of 0, 1 and 2 for 3, ...
  std::vector<std::vector<float>> earlier;
  // [layers][heads][2 * side - 1]: added to scores of a query and a key, by their steps in rows and in columns.
  std::vector<float> row_bias, column_bias;

  bool has_motion() const { return frames > before; }
  size_t places() const { return side * side; }
  // Of slice `k` (rows of `earlier`) for the slice `of` after it.
  const std::vector<float>& earlier_rows(size_t of, size_t k) const { return earlier[of * (of - 1) / 2 + k]; }
};

// `bytes` may be null where `count` is 0, and are not needed afterwards. `name` begins the sentence of errors. Whatever
// the bytes: sizes are limited, and numbers are finite. Throws MAQ_ERROR_BAD_BUNDLE for what is not such a file,
// truncated or damaged; MAQ_ERROR_UNSUPPORTED for another version.
TransformerTables read_row_file(const void* bytes, size_t count, const std::string& name);

}  // namespace maq
