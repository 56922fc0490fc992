// SHA-256 (FIPS 180-4), for the checks of model bundles.
#pragma once

#include <cstddef>
#include <string>

namespace maq {

// The digest in lower-case hexadecimal, 64 characters.
std::string sha256_hex(const void* data, size_t size_bytes);

}  // namespace maq
