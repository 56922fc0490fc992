// Paths of files, and reading whole files.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/files/unique_fd.h"

namespace maq {

bool file_exists(const std::string& path);  // and is no folder
bool is_folder(const std::string& path);

// Whether a relative path read from a file stays inside its folder: it is not empty, does not begin with '/' and has no
// part "..". Links are not followed.
bool stays_inside(const std::string& relative_path);

// The extension of a file's name with its dot, in lower case: ".png" of "a.b/C.PNG"; "" when it has none.
std::string lower_case_extension(const std::string& path);

struct OpenFile {
  UniqueFd fd;
  uint64_t size_bytes = 0;
};

// Opens a regular file for reading. Throws MAQ_ERROR_NOT_FOUND when there is none, MAQ_ERROR_UNREADABLE when it cannot
// be read or is something else: a folder, a pipe, a device.
OpenFile open_file(const std::string& path);

// Throws an error for wrong first bytes of a file.
using StartCheck = std::function<void(const std::vector<uint8_t>& start)>;

// Reads a regular file, or a pipe such as /dev/stdin, to its end. `check_start` gets the first 64 KiB, or a whole
// shorter file, before more is read. Throws the errors of open_file(), and MAQ_ERROR_UNREADABLE when there are more
// than `max_bytes`, no program writes to the pipe, or its writer gives nothing for 10 seconds.
std::vector<uint8_t> read_file(const std::string& path, uint64_t max_bytes, const StartCheck& check_start = {});

}  // namespace maq
