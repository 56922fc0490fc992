#include "source_argument.h"

#include <maquette/maquette.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace fs = std::filesystem;

namespace {

bool has_video_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  constexpr const char* kKnown[] = {".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ogv"};
  return std::any_of(std::begin(kKnown), std::end(kKnown), [&](const char* known) { return extension == known; });
}

bool has_video_content(const fs::path& path) {
  std::array<char, 12> head{};
  std::ifstream(path, std::ios::binary).read(head.data(), head.size());
  return std::memcmp(&head[4], "ftyp", 4) == 0 || std::memcmp(&head[8], "AVI ", 4) == 0 ||
         std::memcmp(head.data(), "\x1a\x45\xdf\xa3", 4) == 0;  // MP4 and MOV; AVI; Matroska and WebM
}

bool has_recording_content(const fs::path& path) {
  std::array<char, 6> head{};
  std::ifstream(path, std::ios::binary).read(head.data(), head.size());
  return std::memcmp(head.data(), "MAQREC", head.size()) == 0;
}

std::string escaped(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == '?') {
      text += "%3F";
    } else if (c == '%') {
      text += "%25";
    } else {
      text += c;
    }
  }
  return text;
}

bool is_known_scheme(const std::string& name) {
  for (uint32_t i = 0; i < maq_source_scheme_count(); ++i) {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    if (maq_source_get_scheme(i, &scheme) == MAQ_OK && name == scheme.name) return true;
  }
  return false;
}

}  // namespace

SourceArgument parse_source_argument(const std::string& text) {
  const size_t colon = text.find(':');
  const std::string scheme = colon == std::string::npos ? "" : text.substr(0, colon);
  std::error_code error;
  if (!is_known_scheme(scheme) && fs::exists(text, error)) {
    if (fs::is_directory(text, error)) {
      throw std::runtime_error(text + " is a folder; name the files in it, as in " + text + "/*.jpg.");
    }
    const char* kind = has_recording_content(text)                            ? "rec:"
                       : has_video_extension(text) || has_video_content(text) ? "video:"
                                                                              : "image:";
    return {kind + escaped(text), fs::path(text).stem().string()};
  }
  if (scheme.empty()) {
    throw std::runtime_error(text +
                             " does not exist; check the path, or see `maquette sources` for what else there is.");
  }
  const std::string target = text.substr(colon + 1, text.find('?', colon) - colon - 1);
  if (scheme == "image" || scheme == "video" || scheme == "rec") return {text, fs::path(target).stem().string()};
  std::string stem = scheme + "_" + target;
  std::replace_if(
      stem.begin(), stem.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return {text, stem};
}
