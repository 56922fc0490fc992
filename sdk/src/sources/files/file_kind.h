// Which kind of source a file is.
#pragma once

#include <string>

namespace maq {

// "image", "video" or "rec": by how the file begins, and for the many kinds of clips that this does not know by its
// extension. What is not there, or cannot be read, is an "image": opening it says what is wrong.
// Throws MAQ_ERROR_INVALID_ARGUMENT for a folder.
const char* scheme_of_file(const std::string& path);

}  // namespace maq
