#include "interrupt.h"

#include <windows.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <mutex>
#include <vector>

namespace {

std::atomic<bool> is_asked{false};

// Never destroyed: the thread of the system that looks through it may outlive main().
struct OpenSources {
  std::mutex mutex;
  std::vector<maq_source*> all;
};
OpenSources& open_sources() {
  static auto* sources = new OpenSources;
  return *sources;
}

// On a thread that the system starts. FALSE: the system ends the program.
BOOL WINAPI handle(DWORD) {
  if (is_asked.exchange(true)) return FALSE;
  const std::lock_guard<std::mutex> lock(open_sources().mutex);
  for (maq_source* source : open_sources().all) maq_source_stop(source);
  return TRUE;
}

}  // namespace

void catch_interrupts() { ::SetConsoleCtrlHandler(handle, TRUE); }

bool interrupted() { return is_asked; }

int interrupting_signal() { return is_asked ? SIGINT : 0; }

StoppedByInterrupt::StoppedByInterrupt(const maquette::Source& source) : source_(source.get()) {
  const std::lock_guard<std::mutex> lock(open_sources().mutex);
  open_sources().all.push_back(source_);
  if (interrupted()) maq_source_stop(source_);
}

StoppedByInterrupt::~StoppedByInterrupt() {
  const std::lock_guard<std::mutex> lock(open_sources().mutex);
  std::vector<maq_source*>& all = open_sources().all;
  all.erase(std::remove(all.begin(), all.end(), source_), all.end());
}
