#include "output/terminal_picture.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "print.h"
#include "terminal_size.h"

namespace {

constexpr int kMaxColumns = 100;

// In grey, near things bright: by inverse depth, from the nearest. Black where nothing is known.
void draw_depth(const maq_frame_desc& depth, uint8_t* rgb) {
  const size_t width = size_t(depth.width_px);
  std::vector<float> inverse(width * size_t(depth.height_px));
  for (size_t i = 0; i < inverse.size(); ++i) {
    const uint8_t* row = depth.planes[0] + i / width * depth.stride_bytes[0];
    float value = 0;
    uint16_t steps = 0;
    if (depth.format == MAQ_PIXEL_DEPTH16) {
      std::memcpy(&steps, row + i % width * sizeof steps, sizeof steps);
      value = steps == UINT16_MAX ? 0 : float(steps);
    } else {
      std::memcpy(&value, row + i % width * sizeof value, sizeof value);
    }
    inverse[i] = std::isnormal(value) && value > 0 ? 1 / value : 0;
  }
  const float largest = *std::max_element(inverse.begin(), inverse.end());
  for (const float value : inverse) rgb = std::fill_n(rgb, 3, uint8_t(largest > 0 ? 255 * value / largest : 0));
}

}  // namespace

bool terminal_shows_pictures() {
  const char* kind = std::getenv("TERM");
  return isatty(STDOUT_FILENO) == 1 && kind != nullptr && std::strcmp(kind, "dumb") != 0;
}

void TerminalPicture::show(const maquette::Frame& frame, const std::string& line) {
  const auto now = std::chrono::steady_clock::now();
  if (now - last_drawn_ < std::chrono::milliseconds(100)) return;
  last_drawn_ = now;
  const maq_frame_desc desc = frame.desc();
  pixels_.resize(size_t(desc.width_px) * size_t(desc.height_px) * 3);
  if (desc.format == MAQ_PIXEL_DEPTH16 || desc.format == MAQ_PIXEL_DEPTH32F) {
    draw_depth(desc, pixels_.data());
  } else {
    frame.copy_pixels(MAQ_PIXEL_RGB8, pixels_.data(), 0, pixels_.size());
  }

  // Characters are about twice as high as they are wide, so that half of one is a square pixel.
  const TerminalSize size = terminal_size(STDOUT_FILENO);
  const double scale = std::min({double(std::min(size.columns, kMaxColumns)) / desc.width_px,
                                 2.0 * std::max(1, size.rows - 2) / desc.height_px, 1.0});
  const int columns = std::max(1, int(desc.width_px * scale));
  const int rows = std::max(1, int(desc.height_px * scale / 2));
  const auto pixel = [&](int column, int half_row) {
    const int x = column * desc.width_px / columns;
    const int y = std::min(half_row * desc.height_px / (2 * rows), desc.height_px - 1);
    return &pixels_[(size_t(y) * size_t(desc.width_px) + size_t(x)) * 3];
  };
  text_.clear();
  if (rows_drawn_ > 0) text_ += "\x1b[" + std::to_string(rows_drawn_) + "A\r";
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const uint8_t* upper = pixel(column, 2 * row);
      const uint8_t* lower = pixel(column, 2 * row + 1);
      char cell[64];
      std::snprintf(cell, sizeof cell, "\x1b[38;2;%d;%d;%dm\x1b[48;2;%d;%d;%dm\u2580", upper[0], upper[1], upper[2],
                    lower[0], lower[1], lower[2]);
      text_ += cell;
    }
    text_ += "\x1b[0m\x1b[K\n";
  }
  text_ += line + "\x1b[K\n";
  rows_drawn_ = rows + 1;
  print_unchanged(text_);
  flush_output();
}
