// A prior with its field (.maqp): refused with a status that the header names, or fit to be used.
#include <cstdlib>

#include "head/files/prior_file.h"
#include "repaired.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::vector<uint8_t> bytes = fuzz::repaired(data, size);
  try {
    const maq::head::HeadPrior prior = maq::head::read_prior(bytes.data(), bytes.size(), "prior.maqp");
    maq::head::check_head_prior(prior);
  } catch (const maq::Error& error) {
    if (error.status() != MAQ_ERROR_BAD_BUNDLE && error.status() != MAQ_ERROR_UNSUPPORTED) std::abort();
  }
  return 0;
}
