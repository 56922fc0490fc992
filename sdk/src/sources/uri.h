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

  // Reads an option of this source and removes it from the list; `fallback` when it was not given.
  // Throws MAQ_ERROR_INVALID_ARGUMENT when it is not a number from `min` to `max`.
  int64_t take_integer(const std::string& key, int64_t fallback, int64_t min, int64_t max);
  double take_number(const std::string& key, double fallback, double min, double max);
  // "" when it was not given.
  std::string take_text(const std::string& key) { return take(key).value_or(""); }
  // Throws MAQ_ERROR_INVALID_ARGUMENT when an option is left over. `known` lists the source's options.
  void expect_no_more_options(const std::string& known) const;

 private:
  std::optional<std::string> take(const std::string& key);
};

// Nothing when the text is not a finite number. Independent of the process's locale, which may expect a comma.
std::optional<double> read_number(const std::string& text);

// Whether the text begins with letters or digits and a colon. Others are paths.
bool has_scheme(const std::string& text);

// Throws MAQ_ERROR_INVALID_ARGUMENT for an ill-formed text and MAQ_ERROR_IMAGE_SIZE for a size outside the limits.
SourceUri parse_source_uri(const std::string& text);

}  // namespace maq
