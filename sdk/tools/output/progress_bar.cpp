#include "output/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "print.h"

namespace {

constexpr int kWidth = 30;
constexpr std::chrono::milliseconds kRedraw{80};

}  // namespace

ProgressBar::ProgressBar(std::string label, int64_t total)
    : label_(printable(label)), total_(total), visible_(isatty(STDERR_FILENO) != 0) {}

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
  const double rate = elapsed_s > 0 ? double(done) / elapsed_s : 0;
  if (total_ < 1) {
    std::fprintf(stderr, "\r%s  %lld frames  %.1f FPS  %s\x1b[K", label_.c_str(), (long long)done, rate,
                 printable(note).c_str());
  } else {
    const int filled = int(std::min<int64_t>(kWidth, done * kWidth / total_));
    std::string bar;
    for (int i = 0; i < kWidth; ++i) bar += i < filled ? "█" : "░";
    const double left_s = rate > 0 ? double(std::max<int64_t>(0, total_ - done)) / rate : 0;
    std::fprintf(stderr, "\r%s  %s %lld/%lld  %.1f FPS  %.0f s left  %s\x1b[K", label_.c_str(), bar.c_str(),
                 (long long)done, (long long)total_, rate, left_s, printable(note).c_str());
  }
  std::fflush(stderr);
}
