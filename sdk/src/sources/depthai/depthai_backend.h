// Opens libmaquette_depthai.so, which brings the vendor's library along.
#pragma once

#include "sources/depthai/depthai_session.h"

namespace maq {

// Opens it at the first call. Throws MAQ_ERROR_RUNTIME_LIBRARY where it is missing, cannot be opened, or is of another
// build.
DepthAiDriver& depthai_driver();

// Whether it is installed at all.
bool has_depthai_library();

}  // namespace maq
