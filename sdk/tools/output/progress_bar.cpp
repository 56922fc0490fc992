#include "output/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "print.h"
#include "terminal_size.h"

namespace {

constexpr int kWidth = 30;  // of the bar, in columns; less in a narrow terminal
constexpr std::chrono::milliseconds kRedraw{80};

// Returns the first letters of UTF-8 text.
std::string beginning_of(const std::string& text, int letters) {
  size_t end = 0;
  while (end < text.size()) {
    const bool begins_letter = (uint8_t(text[end]) & 0xc0) != 0x80;
    if (begins_letter && letters-- == 0) break;
    ++end;
  }
  return text.substr(0, end);
}

}  // namespace

ProgressBar::ProgressBar(std::string label, int64_t total, Shown shown)
    : label_(printable(label)), total_(total), shown_(shown), visible_(isatty(STDERR_FILENO) != 0) {}

void ProgressBar::finish() {
  if (drawn_) std::fputc('\n', stderr);
  drawn_ = false;
}

void ProgressBar::advance(int64_t done, const std::string& note) {
  const auto now = std::chrono::steady_clock::now();
  if (!visible_ || (done != total_ && now - last_drawn_ < kRedraw)) return;
  last_drawn_ = now;
  drawn_ = true;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  // The last column stays free: some terminals begin a new line after it.
  const int columns = terminal_size(STDERR_FILENO).columns;
  const std::string shown = beginning_of(text(done, note, elapsed_s, std::min(kWidth, columns / 3)), columns - 1);
  std::fprintf(stderr, "\r%s\x1b[K", shown.c_str());
  std::fflush(stderr);
}

std::string ProgressBar::text(int64_t done, const std::string& note, double elapsed_s, int width) const {
  const double rate = elapsed_s > 0 ? double(done) / elapsed_s : 0;
  char figures[96];
  if (total_ < 1) {
    std::snprintf(figures, sizeof figures, "  %lld frames  %.1f FPS  ", (long long)done, rate);
    return label_ + figures + printable(note);
  }
  const int filled = int(std::min<int64_t>(width, done * width / total_));
  std::string bar;
  for (int i = 0; i < width; ++i) bar += i < filled ? "█" : "░";
  const double left_s = rate > 0 ? double(std::max<int64_t>(0, total_ - done)) / rate : 0;
  if (shown_ == Shown::kPercent) {
    std::snprintf(figures, sizeof figures, " %3.0f %%  %.0f s left  ", 100.0 * double(done) / double(total_), left_s);
  } else {
    std::snprintf(figures, sizeof figures, " %lld/%lld  %.1f FPS  %.0f s left  ", (long long)done, (long long)total_,
                  rate, left_s);
  }
  return label_ + "  " + bar + figures + printable(note);
}
