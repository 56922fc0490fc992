// Modules: parts of the SDK that bring foreign libraries along (OpenCV's codecs, libcamera, DepthAI). Each is a shared
// library of its own, opened when it is first needed, so that an app without cameras or files does without them.
//
// Exceptions may cross the boundary between the SDK and a module, under these rules:
// - A module throws an Error or an exception of the standard library, nothing else. Both sides are built together and
//   share one C++ runtime; libstdc++ compares the types of exceptions by name, so that they match although the symbols
//   of a module are private (RTLD_LOCAL).
// - Exceptions of another library (cv::Exception, exceptions of DepthAI) are caught inside the module. They become an
//   Error, an exception of the standard library, or a result of the function.
// - Functions that a thread of another library, or C code, calls are noexcept.
#pragma once

#include <string>

namespace maq {

// The export of a module, returned by a function without arguments: its version, which must equal the SDK's version,
// and an object whose type both sides know.
struct ModuleExport {
  const char* version;
  void* object;
};

// The folder of the shared library (or program) that this function was linked into, with a final '/'; "" if the system
// does not tell.
std::string library_folder();

// Returns the path of a file or folder of share/maquette, such as "stub/people.jpg": in share/ beside the library's
// lib/, or beside lib/<architecture>/, as on Debian. "" where it does not exist.
std::string find_shared_file(const std::string& name);

// The path of a module: in maquette/ beside this copy of the SDK.
std::string module_path(const char* file);

// A library that dlopen() opened, or null and why not.
struct LibraryOpening {
  void* library = nullptr;
  std::string error;
};

// With all symbols resolved and kept private. Throws std::bad_alloc where there is too little memory.
LibraryOpening open_library(const std::string& path);

// Null where the library does not have it.
void* find_symbol(void* library, const char* name);
void close_library(void* library);

// Opens a module and returns the object that its function `symbol` exports. It is never closed again: the foreign
// libraries do not survive unloading, and their threads may still run. Throws MAQ_ERROR_RUNTIME_LIBRARY where the
// module is missing or of another build; the sentence begins with `needed_for` ("Image and video files need") and ends
// with `remedy`.
void* open_module(const char* file, const char* symbol, const char* needed_for, const char* remedy);

}  // namespace maq
