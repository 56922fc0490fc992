// One fitted head in a file (.maqh, docs/reference/formats.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "head/stored_head.h"

namespace maq::head {

inline constexpr uint64_t kMaxHeadFileBytes = uint64_t(8) << 20;

// Weights and anchors are rounded to float16, all else stays as it is: some 60 KB with the default field and 800
// anchors. Throws MAQ_ERROR_INVALID_ARGUMENT for a head with a fault (stored_head_fault), or weights beyond 65504.
std::vector<uint8_t> head_file_bytes(const StoredHead& head);

// Replaces a file of that name atomically, once the new one is complete and on the disk. Throws the errors of
// head_file_bytes() and AtomicFile.
void write_head_file(const StoredHead& head, const std::string& path);

// `bytes` may be null where `count` is 0, and are not needed afterwards. `name` begins the sentence of errors. Hostile
// bytes with a correct checksum are safe too: the result has no fault, and takes at most some eight times the file's
// memory. Throws MAQ_ERROR_UNREADABLE for a file that is not a head, truncated or damaged; MAQ_ERROR_UNSUPPORTED for
// another version than 1 and 2, a field that the engine does not take, or more than kMaxHeadFileBytes.
StoredHead read_head(const void* bytes, size_t count, const std::string& name);

// Also throws the errors of read_file().
StoredHead read_head_file(const std::string& path);

}  // namespace maq::head
