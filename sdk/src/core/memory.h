// Too little memory, where foreign libraries do not tell of it.
#pragma once

#include <cstddef>

namespace maq {

// Whether the process could get that much memory now.
bool has_memory(size_t bytes);

// Throws std::bad_alloc unless it could.
void require_memory(size_t bytes);

// How much address space a limit of this process leaves (RLIMIT_AS: ulimit -v); SIZE_MAX where there is no limit.
size_t address_space_left();

// The memory for the thread-local storage of a library when a thread first uses it. Without it glibc ends the
// process.
inline constexpr size_t kThreadLocalBytes = 64 << 10;

}  // namespace maq
