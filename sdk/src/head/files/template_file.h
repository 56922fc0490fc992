// The template head in a file of a bundle (.maqt, docs/reference/formats.md). export/heads/template_file.py writes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "head/head_template.h"

namespace maq::head {

inline constexpr uint64_t kMaxTemplateFileBytes = uint64_t(8) << 20;

// `bytes` may be null where `count` is 0, and are not needed afterwards. `name` begins the sentence of errors. Hostile
// bytes with a correct checksum are safe too: the result has no fault, and takes at most some eight times the file's
// memory. Throws MAQ_ERROR_BAD_BUNDLE for a file that is not a template, truncated or damaged; MAQ_ERROR_UNSUPPORTED
// for another version, or more than kMaxTemplateFileBytes.
HeadTemplate read_template(const void* bytes, size_t count, const std::string& name);

}  // namespace maq::head
