#include "sources/uri.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <locale>
#include <sstream>

#include "core/error.h"
#include "core/frame.h"

namespace maq {
namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// A '%' without two hexadecimal digits after it is kept, so that most file names need no escapes.
std::string percent_decoded(const std::string& text, const SourceUri& uri) {
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0) {
      decoded += char(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2]));
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  // Files are opened by texts that end with the first zero byte: it would be another file.
  if (decoded.find('\0') != std::string::npos) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, uri.text, " has a zero byte (%00), which no name can have.");
  }
  return decoded;
}

// False when the text is not a whole number, or one that does not fit.
bool read_integer(const std::string& text, int64_t* value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc() && end == text.data() + text.size();
}

void read_options(const std::string& query, SourceUri& uri) {
  size_t begin = 0;
  while (begin <= query.size()) {
    const size_t end = std::min(query.find('&', begin), query.size());
    const std::string pair = query.substr(begin, end - begin);
    const size_t equals = pair.find_first_of("=@");
    if (equals == 0 || equals == std::string::npos) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Option \"", pair, "\" of ", uri.text, " is not key=value.");
    }
    const std::string key = percent_decoded(pair.substr(0, equals), uri);
    const std::string value = pair.substr(pair[equals] == '=' ? equals + 1 : equals);  // unplug@5s: the value is "@5s"
    if (!uri.options.emplace(key, percent_decoded(value, uri)).second) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Option ", key, " is given twice in ", uri.text, ".");
    }
    begin = end + 1;
  }
}

void take_size(SourceUri& uri) {
  const auto found = uri.options.find("size");
  if (found == uri.options.end()) return;
  const std::string value = found->second;
  const size_t cross = value.find('x');
  int64_t width = 0;
  int64_t height = 0;
  if (cross == std::string::npos || !read_integer(value.substr(0, cross), &width) ||
      !read_integer(value.substr(cross + 1), &height)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "size=", value, " in ", uri.text, " is not a size; write size=640x480.");
  }
  check_image_size(width, height, "The size asked for in " + uri.text);
  uri.width_px = int(width);
  uri.height_px = int(height);
  uri.options.erase(found);
}

}  // namespace

std::optional<double> read_number(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  in.exceptions(std::ios::badbit);  // without memory
  double value = 0;
  if (text.empty() || !(in >> value) || !in.eof() || !std::isfinite(value)) return {};
  return value;
}

std::optional<std::string> SourceUri::take(const std::string& key) {
  const auto found = options.find(key);
  if (found == options.end()) return {};
  std::string value = std::move(found->second);
  options.erase(found);
  return value;
}

int64_t SourceUri::take_integer(const std::string& key, int64_t fallback, int64_t min, int64_t max) {
  const auto value = take(key);
  if (!value) return fallback;
  int64_t number = 0;
  if (!read_integer(*value, &number) || number < min || number > max) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, key, "=", *value, " in ", text, " must be a whole number from ", min,
                " to ", max, ".");
  }
  return number;
}

double SourceUri::take_number(const std::string& key, double fallback, double min, double max) {
  const auto value = take(key);
  if (!value) return fallback;
  const auto number = read_number(*value);
  if (!number || *number < min || *number > max) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, key, "=", *value, " in ", text, " must be a number from ", min, " to ", max,
                ".");
  }
  return *number;
}

void SourceUri::expect_no_more_options(const std::string& known) const {
  if (options.empty()) return;
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, "Option ", options.begin()->first, " in ", text, " is not known; ", scheme,
              ": has ", known, ".");
}

bool has_scheme(const std::string& text) {
  const size_t colon = text.find(':');
  return colon != std::string::npos && colon > 0 &&
         std::all_of(text.begin(), text.begin() + std::ptrdiff_t(colon),
                     [](unsigned char c) { return std::isalnum(c) != 0; });
}

SourceUri parse_source_uri(const std::string& text) {
  SourceUri uri;
  uri.text = text;
  const size_t colon = text.find(':');
  if (!has_scheme(text)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "\"", text,
                "\" is not a source; write scheme:target, as in image:photo.jpg or stub:people.");
  }
  uri.scheme = text.substr(0, colon);
  const size_t question = text.find('?', colon);
  uri.target =
      percent_decoded(text.substr(colon + 1, question == std::string::npos ? question : question - colon - 1), uri);
  if (question != std::string::npos) read_options(text.substr(question + 1), uri);
  take_size(uri);
  uri.fps = uri.take_number("fps", 0, 0.01, 1000);
  return uri;
}

}  // namespace maq
