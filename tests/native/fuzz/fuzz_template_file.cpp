// The template head (.maqt): refused with a status that the header names, or without a fault.
#include <cstdlib>

#include "head/files/template_file.h"
#include "repaired.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::vector<uint8_t> bytes = fuzz::repaired(data, size);
  try {
    const maq::head::HeadTemplate head = maq::head::read_template(bytes.data(), bytes.size(), "template.maqt");
    if (!maq::head::template_fault(head).empty()) std::abort();
  } catch (const maq::Error& error) {
    if (error.status() != MAQ_ERROR_BAD_BUNDLE && error.status() != MAQ_ERROR_UNSUPPORTED) std::abort();
  }
  return 0;
}
