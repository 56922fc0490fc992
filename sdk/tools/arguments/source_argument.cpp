#include "arguments/source_argument.h"

#include <maquette/maquette.h>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>

namespace fs = std::filesystem;

namespace {

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
  for (uint32_t i = 0; i < maq_source_get_scheme_count(); ++i) {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    if (maq_source_get_scheme(i, &scheme) == MAQ_OK && name == scheme.name) return true;
  }
  return false;
}

}  // namespace

SourceArgument parse_source_argument(const std::string& text) {
  if (text.empty()) throw std::runtime_error("The source is empty; name a file, or see `maquette sources`.");
  const size_t colon = text.find(':');
  const std::string scheme = colon == std::string::npos ? "" : text.substr(0, colon);
  for (const char* cameras : {"/dev/video", "/dev/v4l/"}) {
    if (text.rfind(cameras, 0) == 0) return {"v4l2:" + escaped(text), "v4l2_" + fs::u8path(text).stem().string()};
  }
  std::error_code error;
  if (!is_known_scheme(scheme) && fs::exists(fs::u8path(text), error)) {
    if (fs::is_directory(fs::u8path(text), error)) {
      throw std::runtime_error(text + " is a folder; name the files in it, as in " + text + "/*.jpg.");
    }
    return {"file:" + escaped(text), fs::u8path(text).stem().string()};
  }
  if (scheme.empty()) {
    throw std::runtime_error(text + " does not exist; check the path, or list other sources with `maquette sources`.");
  }
  const std::string target = text.substr(colon + 1, text.find('?', colon) - colon - 1);
  if (scheme == "file" || scheme == "image" || scheme == "video" || scheme == "rec")
    return {text, fs::u8path(target).stem().string()};
  std::string stem = scheme + "_" + target;
  std::replace_if(
      stem.begin(), stem.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return {text, stem};
}
