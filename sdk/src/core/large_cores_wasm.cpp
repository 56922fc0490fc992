#include "core/worker_threads.h"

namespace maq {

// The build has no threads.
std::vector<int> allowed_cores() { return {0}; }

int count_large_cores(const std::vector<int>& allowed, const std::string&) { return int(allowed.size()); }

}  // namespace maq
