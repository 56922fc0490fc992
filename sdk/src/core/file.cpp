#include "core/file.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "core/error.h"

namespace maq {

bool file_exists(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && !S_ISDIR(status.st_mode);
}

bool is_folder(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

bool stays_inside(const std::string& relative_path) {
  if (relative_path.empty() || relative_path[0] == '/') return false;
  if (relative_path.find('\0') != std::string::npos) return false;
  const std::string parts = "/" + relative_path + "/";
  return parts.find("/../") == std::string::npos;
}

std::string lower_case_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  // ASCII, whatever the locale of the process.
  for (char& letter : extension) {
    if (letter >= 'A' && letter <= 'Z') letter = char(letter - 'A' + 'a');
  }
  return extension;
}

std::vector<uint8_t> read_file(const std::string& path) {
  if (is_folder(path)) throw Error(MAQ_ERROR_UNREADABLE, path, " is a folder, not a file.");
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (file == nullptr) {
    const int reason = errno;
    const bool missing = reason == ENOENT || reason == ENOTDIR;
    throw Error(missing ? MAQ_ERROR_NOT_FOUND : MAQ_ERROR_UNREADABLE, path,
                missing ? " does not exist" : " cannot be opened",
                missing ? "; check the path." : concatenate(" (", std::strerror(reason), ")."));
  }
  std::vector<uint8_t> bytes;
  uint8_t block[1 << 16];
  while (const size_t count = std::fread(block, 1, sizeof block, file.get())) {
    bytes.insert(bytes.end(), block, block + count);
  }
  if (std::ferror(file.get()) != 0) throw Error(MAQ_ERROR_UNREADABLE, path, " cannot be read to its end.");
  return bytes;
}

}  // namespace maq
