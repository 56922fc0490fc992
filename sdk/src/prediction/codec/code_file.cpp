#include "prediction/codec/code_file.h"

#include "core/files/checked_bytes.h"

namespace maq {
namespace {

constexpr char kCodeFileMagic[8] = {'M', 'A', 'Q', 'C', 'O', 'D', '\r', '\n'};
constexpr uint32_t kCodeFileVersion = 1;

struct CodeFileHead {
  FileStart start;
  uint32_t groups, entries, width, side;
};
static_assert(sizeof(CodeFileHead) == 48);

}  // namespace

FrameCodes read_code_file(const void* bytes, size_t count, const std::string& name) {
  CheckedBytes file(bytes, count, name, MAQ_ERROR_BAD_BUNDLE);
  const auto head = file.head<CodeFileHead>(kCodeFileMagic, kCodeFileVersion, "a file of codes (.maqc)",
                                            "Export the bundle again, or use the Maquette that it was made for.");
  FrameCodes codes;
  codes.groups = file.size_within(head.groups, kMaxCodeGroups, "codebook groups");
  codes.entries = file.size_within(head.entries, kMaxCodeEntries, "entries");
  codes.width = file.size_within(head.width, kMaxCodeWidth, "numbers an entry");
  codes.side = file.size_within(head.side, kMaxCodeSide, "cells in a row");
  codes.vectors = file.floats(codes.groups * codes.entries * codes.width);
  codes.unigram_bits = file.bytes(codes.groups * codes.entries);
  codes.bigram_bits = file.bytes(codes.groups * codes.entries * codes.entries);
  file.end();
  return codes;
}

}  // namespace maq
