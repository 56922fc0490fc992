#include "arguments/picture_size.h"

#include <charconv>
#include <stdexcept>

PictureSize parse_picture_size(const std::string& text, const std::string& option) {
  PictureSize size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width_px);
  const bool goes_on = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = goes_on ? std::from_chars(width.ptr + 1, end, size.height_px) : width;
  if (!goes_on || height.ec != std::errc() || height.ptr != end || size.width_px < 1 || size.height_px < 1) {
    throw std::runtime_error(option + " " + text + " is not a size; write it as 640x480.");
  }
  return size;
}
