#include "interrupt.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <ctime>
#include <initializer_list>
#include <system_error>
#include <thread>

#include "open_sources.h"

namespace {

// timeout(1) and some supervisors send a signal to the process and to its group: both are the same request.
constexpr int64_t kSameRequestNs = 500000000;

std::atomic<int64_t> asked_ns{0};  // when; 0: not yet
std::atomic<int> asking_signal{0};
int event = -1;

int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t(now.tv_sec) * 1000000000 + now.tv_nsec;
}

// Calls only what a signal handler may.
void handle(int number) {
  const int error = errno;
  const int64_t now = now_ns();
  int64_t first = 0;
  int none = 0;
  asking_signal.compare_exchange_strong(none, number);
  if (asked_ns.compare_exchange_strong(first, now)) {
    const uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(event, &one, sizeof one);
  } else if (now - first > kSameRequestNs) {
    std::signal(number, SIG_DFL);
    std::raise(number);
  }
  errno = error;
}

void stop_sources_when_asked() {
  uint64_t count = 0;
  while (read(event, &count, sizeof count) < 0 && errno == EINTR) {
  }
  stop_open_sources();
}

}  // namespace

void catch_interrupts() {
  if (event >= 0) return;
  event = eventfd(0, EFD_CLOEXEC);
  try {
    if (event >= 0) std::thread(stop_sources_when_asked).detach();
  } catch (const std::system_error&) {
    return;  // no more threads: signals end the program as they find it
  }
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    const auto before = std::signal(number, handle);
    if (number == SIGHUP && before == SIG_IGN) std::signal(number, SIG_IGN);  // nohup(1)
  }
}

bool interrupted() { return asked_ns != 0; }

int interrupting_signal() { return asking_signal; }
