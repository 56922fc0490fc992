#include "interrupt.h"

#include <windows.h>

#include <atomic>
#include <csignal>

#include "open_sources.h"

namespace {

std::atomic<bool> is_asked{false};

// On a thread that the system starts. FALSE: the system ends the program.
BOOL WINAPI handle(DWORD) {
  if (is_asked.exchange(true)) return FALSE;
  stop_open_sources();
  return TRUE;
}

}  // namespace

void catch_interrupts() { ::SetConsoleCtrlHandler(handle, TRUE); }

bool interrupted() { return is_asked; }

int interrupting_signal() { return is_asked ? SIGINT : 0; }
