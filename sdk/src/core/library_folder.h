// Where this copy of the SDK lies.
#pragma once

#include <string>

namespace maq {

// The folder of the shared library (or program) that this function was linked into, with a final '/'; "" if the system
// does not tell.
std::string own_folder();

}  // namespace maq
