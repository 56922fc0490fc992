// Sizes of images on the command line, such as 640x480.
#pragma once

#include <string>

struct PictureSize {
  int width_px = 0, height_px = 0;
};

// Throws std::runtime_error for an invalid size, with the name of its option.
PictureSize parse_picture_size(const std::string& text, const std::string& option = "--size");
