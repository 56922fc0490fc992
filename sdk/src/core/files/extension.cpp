#include <filesystem>

#include "core/files/file.h"

namespace maq {

std::string lower_case_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  // ASCII, whatever the locale of the process.
  for (char& letter : extension) {
    if (letter >= 'A' && letter <= 'Z') letter = char(letter - 'A' + 'a');
  }
  return extension;
}

}  // namespace maq
