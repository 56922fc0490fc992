// A progress bar on standard error: one line, which is rewritten and never longer than the terminal is wide. Nothing
// when that is not a terminal.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

class ProgressBar {
 public:
  enum class Shown { kFrames, kPercent };

  // `total` below 1: not known, so only a count is shown.
  ProgressBar(std::string label, int64_t total, Shown shown = Shown::kFrames);
  ~ProgressBar() { finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void advance(int64_t done, const std::string& note);
  // Ends the line of the bar: later output starts on a new line.
  void finish();

 private:
  std::string text(int64_t done, const std::string& note, double elapsed_s, int width) const;

  std::string label_;
  int64_t total_;
  Shown shown_;
  bool visible_;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point last_drawn_{};
};
