// Parts of the SDK that bring libraries of others: each is a library of its own, which is opened when it is needed first,
// so that an app that never needs it does without those libraries.
#pragma once

#include <string>

namespace maq {

// What such a library exports, by a function without arguments: its version, which must be that of the SDK, and an object
// whose type both sides know.
struct ModuleExport {
  const char* version;
  void* object;
};

// Where such a library lies: in maquette/ beside this copy of the SDK.
std::string module_path(const char* file);

// Opens it and returns the object that its function `symbol` exports. Never closed again: the libraries below it do not
// survive unloading, and threads of theirs may still run. Throws MAQ_ERROR_RUNTIME_LIBRARY where it is missing or of
// another build; the sentence begins with `needed_for` ("Image and video files need") and ends with `remedy`.
void* open_module(const char* file, const char* symbol, const char* needed_for, const char* remedy);

}  // namespace maq
