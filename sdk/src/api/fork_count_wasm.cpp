#include "api/handle_state.h"

namespace maq {

uint32_t fork_count() { return 0; }  // WebAssembly has no processes

}  // namespace maq
