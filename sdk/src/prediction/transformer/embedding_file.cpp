#include "prediction/transformer/embedding_file.h"

#include "core/files/checked_bytes.h"
#include "prediction/codec/code_file.h"

namespace maq {
namespace {

constexpr char kEmbeddingFileMagic[8] = {'M', 'A', 'Q', 'R', 'O', 'W', '\r', '\n'};
constexpr uint32_t kEmbeddingFileVersion = 1;

struct EmbeddingFileHead {
  FileStart start;
  uint32_t groups, entries, side, before, frames, embedding, width, layers, heads, row_bytes;
};
static_assert(sizeof(EmbeddingFileHead) == 72);

// Floats, or bytes with one scale per row.
std::vector<float> read_rows(CheckedBytes& file, uint32_t row_bytes, size_t rows, size_t width) {
  if (row_bytes == 4) return file.floats(rows * width);
  const std::vector<float> scales = file.floats(rows);
  const std::vector<uint8_t> steps = file.bytes(rows * width);
  std::vector<float> values(steps.size());
  for (size_t row = 0; row < rows; ++row) {
    for (size_t i = row * width; i < (row + 1) * width; ++i) values[i] = scales[row] * float(int8_t(steps[i]));
  }
  return values;
}

}  // namespace

TransformerTables read_embedding_file(const void* bytes, size_t count, const std::string& name) {
  CheckedBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head = file.head<EmbeddingFileHead>(kEmbeddingFileMagic, kEmbeddingFileVersion, "a file of rows (.maqr)",
                                                 "Export the bundle again, or use the Maquette that it was made for.");
  TransformerTables tables;
  tables.groups = file.size_within(head.groups, kMaxCodeGroups, "codebook groups");
  tables.entries = file.size_within(head.entries, kMaxCodeEntries, "entries");
  tables.side = file.size_within(head.side, kMaxCodeSide, "cells in a row");
  tables.before = file.size_within(head.before, kMaxContextFrames - 1, "frames before");
  tables.frames = file.size_within(head.frames, kMaxContextFrames, "frames");
  tables.embedding = file.size_within(head.embedding, 1024, "numbers a row");
  tables.width = file.size_within(head.width, 4096, "features a cell");
  tables.layers = file.size_within(head.layers, 64, "layers");
  tables.heads = file.size_within(head.heads, 64, "heads");
  if (tables.frames != tables.before && tables.frames != tables.before + 1) {
    file.fail(" has ", tables.frames, " frames, of which ", tables.before, " are the stream's.");
  }
  if (head.row_bytes != 1 && head.row_bytes != 4) {
    file.fail(" has numbers of ", head.row_bytes, " bytes; 1 or 4 are allowed.");
  }
  const size_t rows = tables.groups * tables.entries;
  tables.context_embeddings = read_rows(file, head.row_bytes, tables.frames * rows, tables.embedding);
  tables.group_embeddings = read_rows(file, head.row_bytes, rows, tables.embedding);
  for (size_t pair = 0; pair < tables.groups * (tables.groups - 1) / 2; ++pair) {
    tables.earlier.push_back(read_rows(file, head.row_bytes, tables.entries, tables.width));
  }
  const size_t biases = tables.layers * tables.heads * (2 * tables.side - 1);
  tables.row_bias = file.floats(biases);
  tables.column_bias = file.floats(biases);
  file.end();
  return tables;
}

}  // namespace maq
