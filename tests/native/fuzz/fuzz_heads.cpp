// The files of heads: refused with a status that their header names, or fit to be used.
#include "checked_file.h"
#include "head/files/head_file.h"
#include "head/files/prior_file.h"
#include "head/files/template_file.h"

using namespace maq::head;

FUZZ(head_file) {
  const fuzz::Bytes file = fuzz::repaired(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_UNREADABLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    const StoredHead head = read_head(file.data(), file.size(), "a.maqh");
    fuzz::require(stored_head_fault(head).empty(), "a head with a fault");
    const fuzz::Bytes first = head_file_bytes(head);
    const StoredHead again = read_head(first.data(), first.size(), "a.maqh");
    fuzz::require(head_file_bytes(again) == first, "a head that is another one when it is written and read");
  });
}

FUZZ(prior_file) {
  const fuzz::Bytes file = fuzz::repaired(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED},
                      [&] { check_head_prior(read_prior(file.data(), file.size(), "prior.maqp")); });
}

FUZZ(template_file) {
  const fuzz::Bytes file = fuzz::repaired(bytes);
  fuzz::run_or_refuse({MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_UNSUPPORTED}, [&] {
    const HeadTemplate head = read_template(file.data(), file.size(), "template.maqt");
    fuzz::require(template_fault(head).empty(), "a template with a fault");
  });
}
