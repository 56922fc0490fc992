#include "output/terminal_picture.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "print.h"

namespace {

constexpr int kMaxColumns = 100;

winsize terminal_size() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) size = {24, 80, 0, 0};
  return size;
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
  frame.copy_pixels(MAQ_PIXEL_RGB8, pixels_.data(), 0, pixels_.size());

  // Characters are about twice as high as they are wide, so that half of one is a square pixel.
  const winsize size = terminal_size();
  const double scale = std::min({double(std::min<int>(size.ws_col, kMaxColumns)) / desc.width_px,
                                 2.0 * std::max(1, size.ws_row - 2) / desc.height_px, 1.0});
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
