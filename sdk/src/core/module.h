// Parts of the SDK that bring libraries of others: each is a library of its own, which is opened when it is needed first,
// so that an app that never needs it does without those libraries.
#pragma once

namespace maq {

// What such a library exports, by a function without arguments: its version, which must be that of the SDK, and an object
// whose type both sides know.
struct ModuleExport {
  const char* version;
  const void* object;
};

// Opens maquette/`file` beside this copy of the SDK and returns what its function `symbol` exports. Never closed again:
// the libraries below it do not survive unloading. Throws MAQ_ERROR_RUNTIME_LIBRARY where it is missing or of another
// build; the sentence begins with `needed_for` ("Image and video files need") and ends with `remedy`.
const void* open_module(const char* file, const char* symbol, const char* needed_for, const char* remedy);

}  // namespace maq
