// Version, commit and options of this build; the texts come from CMake.
#pragma once

namespace maq {

const char* sdk_version();
const char* git_commit();
const char* build_options();

}  // namespace maq
