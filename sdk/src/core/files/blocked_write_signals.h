// Writes that fail by an error alone: a limit on file sizes (SIGXFSZ) and a pipe without a reader (SIGPIPE) would
// also end the process, and its signal handlers are not the library's to set.
#pragma once

#include <pthread.h>

#include <csignal>
#include <ctime>

namespace maq {

// For the calling thread, which gets both signals itself, as long as this lives.
class BlockedWriteSignals {
 public:
  BlockedWriteSignals() {
    sigemptyset(&ours_);
    sigaddset(&ours_, SIGXFSZ);
    sigaddset(&ours_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    for (const int number : {SIGXFSZ, SIGPIPE}) {
      if (sigismember(&pending, number) == 1) sigdelset(&ours_, number);  // another cause; it stays pending
    }
    pthread_sigmask(SIG_BLOCK, &ours_, &before_);
  }
  ~BlockedWriteSignals() {
    const timespec now{};
    while (sigtimedwait(&ours_, nullptr, &now) > 0) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  BlockedWriteSignals(const BlockedWriteSignals&) = delete;
  BlockedWriteSignals& operator=(const BlockedWriteSignals&) = delete;

 private:
  sigset_t ours_{}, before_{};
};

}  // namespace maq
