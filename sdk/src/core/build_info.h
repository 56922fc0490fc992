// What this library was built from; the texts come from CMake.
#pragma once

namespace maquette {

const char* sdk_version();
const char* git_commit();
const char* build_options();

}  // namespace maquette
