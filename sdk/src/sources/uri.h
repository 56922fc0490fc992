// The URIs that name sources: "scheme:target?key=value&key=value".
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace maq {

struct SourceUri {
  std::string text;    // as it was given
  std::string scheme;  // "video"
  std::string target;  // "clip.mp4", percent-decoded
  std::map<std::string, std::string> options;

  // Options that every source has.
  int width_px = 0;  // 0: as the source comes
  int height_px = 0;
  double fps = 0;  // 0: as the source comes

  // Reads an option of this source and takes it off the list; `otherwise` when it was not given.
  // Throws MAQ_ERROR_INVALID_ARGUMENT when it is no number, or not within `least` and `most`.
  int64_t take_integer(const std::string& key, int64_t otherwise, int64_t least, int64_t most);
  double take_number(const std::string& key, double otherwise, double least, double most);
  // "" when it was not given.
  std::string take_text(const std::string& key) { return take(key).value_or(""); }
  // Throws MAQ_ERROR_INVALID_ARGUMENT when an option is left that nobody took. `known` names those there are.
  void expect_no_more_options(const std::string& known) const;

 private:
  std::optional<std::string> take(const std::string& key);
};

// Nothing when the text is no finite number. Independent of the process's locale, which may want a comma.
std::optional<double> read_number(const std::string& text);

// Throws MAQ_ERROR_INVALID_ARGUMENT for an ill-formed text and MAQ_ERROR_IMAGE_SIZE for a size outside the limits.
SourceUri parse_source_uri(const std::string& text);

}  // namespace maq
