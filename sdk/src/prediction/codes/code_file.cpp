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

}  // namespace

FrameCodes read_code_file(const void* bytes, size_t count, const std::string& name) {
  CheckedBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head = file.head<CodeFileHead>(kCodeFileMagic, kCodeFileVersion, "a file of codes (.maqc)",
                                            "Export the bundle again, or use the Maquette that it was made for.");
  FrameCodes codes;
  codes.slices = file.size_within(head.slices, kMaxCodeSlices, "slices");
  codes.entries = file.size_within(head.entries, kMaxCodeEntries, "entries");
  codes.width = file.size_within(head.width, kMaxCodeWidth, "numbers an entry");
  codes.side = file.size_within(head.side, kMaxCodeSide, "places in a row");
  codes.vectors = file.floats(codes.slices * codes.entries * codes.width);
  codes.frequency_bits = file.bytes(codes.slices * codes.entries);
  codes.after_bits = file.bytes(codes.slices * codes.entries * codes.entries);
  file.end();
  return codes;
}

}  // namespace maq
