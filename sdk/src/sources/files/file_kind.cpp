#include "sources/files/file_sources.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"

namespace fs = std::filesystem;

namespace maq {

const char* scheme_of_file(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " is a folder; name a file in it.");
  }
  std::array<char, 12> head{};
  std::ifstream(path, std::ios::binary).read(head.data(), head.size());
  const auto has = [&](size_t at, const char* text) { return std::memcmp(&head[at], text, std::strlen(text)) == 0; };
  if (has(0, "MAQREC")) return "rec";
  if (has(4, "ftyp") || has(8, "AVI ") || has(0, "\x1a\x45\xdf\xa3")) return "video";  // MP4, MOV; AVI; Matroska, WebM
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  constexpr const char* kClips[] = {".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ogv"};
  return std::any_of(std::begin(kClips), std::end(kClips), [&](const char* clip) { return extension == clip; })
             ? "video"
             : "image";
}

}  // namespace maq
