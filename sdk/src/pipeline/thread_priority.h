// How the system prefers a thread.
#pragma once

namespace maq {

// Makes this thread give way to others. `nice`: 0 leaves it as it is, 19 is the lowest; threads that this one starts
// inherit it on Linux.
void lower_priority_of_this_thread(int nice);

}  // namespace maq
