// The prior of heads in a file of a bundle (.maqp, docs/reference/formats.md). export/heads/prior_file.py writes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "head/head_prior.h"

namespace maq::head {

inline constexpr uint64_t kMaxPriorFileBytes = uint64_t(32) << 20;

// `bytes` may be null where `count` is 0, and are not needed afterwards. `name` begins the sentence of errors. Whatever
// the bytes, also those of a hostile file with a right checksum: what comes back passes check_head_prior(), and takes
// at most some eight times the file's memory, which is not taken before the file was seen to be long enough. Throws
// MAQ_ERROR_BAD_BUNDLE for what is not a prior, truncated or damaged; MAQ_ERROR_UNSUPPORTED for another version, a
// field that the engine does not take, or more than kMaxPriorFileBytes.
HeadPrior read_prior(const void* bytes, size_t count, const std::string& name);

// Reads one file. Also throws the errors of read_file().
HeadPrior read_prior_file(const std::string& path);

}  // namespace maq::head
