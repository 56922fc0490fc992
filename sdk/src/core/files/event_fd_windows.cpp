#include <windows.h>

#include <climits>

#include "core/error.h"
#include "core/files/event_fd.h"

namespace maq {
namespace {

// A HANDLE has 32 bits that count, also in programs of 64 bits.
HANDLE event_of(int event) { return reinterpret_cast<HANDLE>(intptr_t(event)); }

}  // namespace

// A semaphore cannot be looked at without taking from it, as wait_for_event() does with a flag; nothing here counts.
EventFd::EventFd(Kind kind) : fd_(0) {
  if (kind == Kind::kCounting) throw Error(MAQ_ERROR_INTERNAL, "Events that count are not made on Windows.");
  const HANDLE made = ::CreateEventW(nullptr, /*bManualReset=*/TRUE, /*bInitialState=*/FALSE, nullptr);
  if (made == nullptr) {
    throw Error(MAQ_ERROR_OUT_OF_MEMORY, "No event can be made to wait for frames (error ", ::GetLastError(),
                " of Windows); close files or sources that are not needed.");
  }
  fd_ = int(reinterpret_cast<intptr_t>(made));
}

EventFd::~EventFd() { ::CloseHandle(event_of(fd_)); }

void EventFd::signal() noexcept { ::SetEvent(event_of(fd_)); }

bool EventFd::take() noexcept {
  const bool was_signalled = ::WaitForSingleObject(event_of(fd_), 0) == WAIT_OBJECT_0;
  ::ResetEvent(event_of(fd_));
  return was_signalled;
}

bool wait_for_event(int event, int64_t time_ns) noexcept {
  constexpr int64_t kMaxMs = INT_MAX;
  const int64_t time_ms = time_ns / 1000000 + (time_ns % 1000000 > 0 ? 1 : 0);
  return ::WaitForSingleObject(event_of(event), DWORD(time_ms < kMaxMs ? time_ms : kMaxMs)) == WAIT_OBJECT_0;
}

}  // namespace maq
