// Images in a terminal: two pixels a character, in true colour.
#pragma once

#include <chrono>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

// Whether standard output is a terminal that can show images.
bool terminal_shows_pictures();

class TerminalPicture {
 public:
  // The image with a line of text below, over the one before; at most ten a second, more are left out. Later output
  // starts on a new line.
  void show(const maquette::Frame& frame, const std::string& line);

 private:
  std::vector<uint8_t> pixels_;
  std::string text_;
  int rows_drawn_ = 0;
  std::chrono::steady_clock::time_point last_drawn_{};
};
