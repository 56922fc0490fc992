// Starts threads. If the system has no more threads, its answer becomes an Error.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <future>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/memory.h"

namespace maq {

// `name`, of at most 15 letters, is for debuggers and `top -H`. Throws MAQ_ERROR_OUT_OF_MEMORY where the system has no
// more threads, or no memory for one.
template <class Body>
std::thread start_thread(const char* name, Body&& body) {
  require_memory(kThreadLocalBytes);  // glibc ends the process where it has none for a new thread's storage
  try {
    std::thread thread(std::forward<Body>(body));
    pthread_setname_np(thread.native_handle(), name);
    return thread;
  } catch (const std::system_error& error) {
    throw Error(MAQ_ERROR_OUT_OF_MEMORY, "The system starts no more threads (", error.code().message(),
                "): raise the limit of this user (ulimit -u) or of the container, or free memory.");
  }
}

// Throws as start_thread() does if the system does not start this many threads now; for foreign libraries that hang, or
// give another reason, where theirs do not start.
inline void require_threads(size_t count) {
  struct Held {
    ~Held() {
      end.set_value();
      for (std::thread& thread : threads) thread.join();
    }
    std::promise<void> end;
    std::vector<std::thread> threads;
  } held;
  const std::shared_future<void> end = held.end.get_future().share();
  while (held.threads.size() < count) held.threads.push_back(start_thread("maq try", [end] { end.wait(); }));
}

}  // namespace maq
