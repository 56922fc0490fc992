// A head (.maqh): refused with a status that the header names, or without a fault and the same when written and read.
#include <cstdlib>

#include "head/files/head_file.h"
#include "repaired.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::vector<uint8_t> bytes = fuzz::repaired(data, size);
  try {
    const maq::head::StoredHead head = maq::head::read_head(bytes.data(), bytes.size(), "a.maqh");
    if (!maq::head::stored_head_fault(head).empty()) std::abort();
    const std::vector<uint8_t> first = maq::head::head_file_bytes(head);
    const maq::head::StoredHead again = maq::head::read_head(first.data(), first.size(), "a.maqh");
    if (maq::head::head_file_bytes(again) != first) std::abort();
  } catch (const maq::Error& error) {
    if (error.status() != MAQ_ERROR_UNREADABLE && error.status() != MAQ_ERROR_UNSUPPORTED) std::abort();
  }
  return 0;
}
