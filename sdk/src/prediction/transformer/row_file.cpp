#include "prediction/transformer/row_file.h"

#include "core/files/checked_bytes.h"
#include "prediction/codes/code_file.h"

namespace maq {
namespace {

constexpr char kRowFileMagic[8] = {'M', 'A', 'Q', 'R', 'O', 'W', '\r', '\n'};
constexpr uint32_t kRowFileVersion = 1;

struct RowFileHead {
  FileStart start;
  uint32_t slices, entries, side, before, frames, embedding, width, layers, heads, row_bytes;
};
static_assert(sizeof(RowFileHead) == 72);

size_t checked_size(const CheckedBytes& file, const char* what, uint32_t value, size_t max) {
  if (value < 1 || value > max) file.fail(" has ", value, " ", what, "; 1 to ", max, " are allowed.");
  return value;
}

// As they are, or as bytes with a scale a row.
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

TransformerTables read_row_file(const void* bytes, size_t count, const std::string& name) {
  CheckedBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head = file.head<RowFileHead>(kRowFileMagic, kRowFileVersion, "a file of rows (.maqr)",
                                           "Export the bundle again, or use the Maquette that it was made for.");
  TransformerTables tables;
  tables.slices = checked_size(file, "slices", head.slices, kMaxCodeSlices);
  tables.entries = checked_size(file, "entries", head.entries, kMaxCodeEntries);
  tables.side = checked_size(file, "places in a row", head.side, kMaxCodeSide);
  tables.before = checked_size(file, "frames before", head.before, kMaxContextFrames - 1);
  tables.frames = checked_size(file, "frames", head.frames, kMaxContextFrames);
  tables.embedding = checked_size(file, "numbers a row", head.embedding, 1024);
  tables.width = checked_size(file, "features a place", head.width, 4096);
  tables.layers = checked_size(file, "layers", head.layers, 64);
  tables.heads = checked_size(file, "heads", head.heads, 64);
  if (tables.frames != tables.before && tables.frames != tables.before + 1) {
    file.fail(" has ", tables.frames, " frames, of which ", tables.before, " are the stream's.");
  }
  if (head.row_bytes != 1 && head.row_bytes != 4) {
    file.fail(" has numbers of ", head.row_bytes, " bytes; 1 or 4 are allowed.");
  }
  const size_t rows = tables.slices * tables.entries;
  tables.context_rows = read_rows(file, head.row_bytes, tables.frames * rows, tables.embedding);
  tables.slice_rows = read_rows(file, head.row_bytes, rows, tables.embedding);
  for (size_t pair = 0; pair < tables.slices * (tables.slices - 1) / 2; ++pair) {
    tables.earlier.push_back(read_rows(file, head.row_bytes, tables.entries, tables.width));
  }
  const size_t biases = tables.layers * tables.heads * (2 * tables.side - 1);
  tables.row_bias = file.floats(biases);
  tables.column_bias = file.floats(biases);
  file.end();
  return tables;
}

}  // namespace maq
