// Paths of files, and reading whole files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace maq {

bool file_exists(const std::string& path);  // and is a regular file, not a folder
bool is_folder(const std::string& path);

// Whether a relative path read from a file stays inside its folder: it is not empty, does not begin with '/' and has no
// part "..". Links are not followed.
bool stays_inside(const std::string& relative_path);

// The extension of a file's name with its dot, in lower case: ".png" of "a.b/C.PNG"; "" when it has none.
std::string lower_case_extension(const std::string& path);

// Throws MAQ_ERROR_NOT_FOUND when there is no such file, MAQ_ERROR_UNREADABLE when it cannot be read.
std::vector<uint8_t> read_file(const std::string& path);

}  // namespace maq
