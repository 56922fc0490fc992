#include "core/module.h"

namespace maq {

// There are no files: bundles come from memory.
std::string library_folder() { return ""; }
std::string find_shared_file(const std::string&) { return ""; }

}  // namespace maq
