#include "prediction/codes/code_file.h"

#include "core/files/checked_bytes.h"

namespace maq {
namespace {

constexpr char kCodeFileMagic[8] = {'M', 'A', 'Q', 'C', 'O', 'D', '\r', '\n'};
constexpr uint32_t kCodeFileVersion = 1;

struct CodeFileHead {
  FileStart start;
  uint32_t slices, entries, width, side;
};
static_assert(sizeof(CodeFileHead) == 48);

size_t checked_size(const CheckedBytes& file, const char* what, uint32_t value, size_t max) {
  if (value < 1 || value > max) file.fail(" has ", value, " ", what, "; 1 to ", max, " are allowed.");
  return value;
}

}  // namespace

FrameCodes read_code_file(const void* bytes, size_t count, const std::string& name) {
  CheckedBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head = file.head<CodeFileHead>(kCodeFileMagic, kCodeFileVersion, "a file of codes (.maqc)",
                                            "Export the bundle again, or use the Maquette that it was made for.");
  FrameCodes codes;
  codes.slices = checked_size(file, "slices", head.slices, kMaxCodeSlices);
  codes.entries = checked_size(file, "entries", head.entries, kMaxCodeEntries);
  codes.width = checked_size(file, "numbers an entry", head.width, kMaxCodeWidth);
  codes.side = checked_size(file, "places in a row", head.side, kMaxCodeSide);
  codes.vectors = file.floats(codes.slices * codes.entries * codes.width);
  codes.frequency_bits = file.bytes(codes.slices * codes.entries);
  codes.after_bits = file.bytes(codes.slices * codes.entries * codes.entries);
  file.end();
  return codes;
}

}  // namespace maq
