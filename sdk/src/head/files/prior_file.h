// The prior of heads in a file of a bundle (.maqp, docs/reference/formats.md). export/heads/prior_file.py writes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "head/head_prior.h"

namespace maq::head {

inline constexpr uint64_t kMaxPriorFileBytes = uint64_t(32) << 20;

// `bytes` may be null where `count` is 0, and are not needed afterwards. `name` begins the sentence of errors. Hostile
// bytes with a correct checksum are safe too: the result passes check_head_prior(). It takes at most some eight times
// the file's memory, and only after the file proved long enough. Throws MAQ_ERROR_BAD_BUNDLE for a file that is not a
// prior, truncated or damaged; MAQ_ERROR_UNSUPPORTED for another version, a field that the engine does not take, or
// more than kMaxPriorFileBytes.
HeadPrior read_prior(const void* bytes, size_t count, const std::string& name);

// Reads one file. Also throws the errors of read_file().
HeadPrior read_prior_file(const std::string& path);

}  // namespace maq::head
