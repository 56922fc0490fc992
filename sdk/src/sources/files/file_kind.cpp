#include "sources/files/file_sources.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/files/file.h"
#include "image/files/image_header.h"

namespace fs = std::filesystem;

namespace maq {

const char* scheme_of_file(const std::string& path) {
  if (is_folder(path)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " is a folder; name a file in it.");
  }
  std::error_code error;
  if (!fs::is_regular_file(fs::u8path(path), error)) return "image";
  constexpr size_t kHeadBytes = 1024;
  std::vector<uint8_t> head(kHeadBytes);
  std::ifstream file(fs::u8path(path), std::ios::binary);
  file.read(reinterpret_cast<char*>(head.data()), std::streamsize(head.size()));
  head.resize(size_t(file.gcount()));
  const std::string magic = "MAQREC";
  if (head.size() >= magic.size() && std::equal(magic.begin(), magic.end(), head.begin())) return "rec";
  const ImageFormat format = recognise_format(head).format;
  if (format != ImageFormat::kUnknown) return format == ImageFormat::kClip ? "video" : "image";
  const std::string extension = lower_case_extension(path);
  constexpr const char* kClips[] = {".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ogv"};
  return std::any_of(std::begin(kClips), std::end(kClips), [&](const char* clip) { return extension == clip; })
             ? "video"
             : "image";
}

}  // namespace maq
