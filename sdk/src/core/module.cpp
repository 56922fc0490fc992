#include "core/module.h"

#include <dlfcn.h>
#include <unistd.h>

#include <climits>
#include <cstring>
#include <new>
#include <string>

#include "core/build_info.h"
#include "core/error.h"
#include "core/memory.h"

namespace maq {
namespace {

// With its dependencies: OpenCV's codecs on Debian 12 take 270 MiB of address space.
constexpr size_t kLargestLibraryBytes = size_t(512) << 20;

}  // namespace

std::string library_folder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&library_folder), &info) == 0 || info.dli_fname == nullptr) return "";
  const std::string file = info.dli_fname;
  if (const size_t slash = file.rfind('/'); slash != std::string::npos) return file.substr(0, slash + 1);
  // A program with the library inside, which the shell found on its PATH: its name has no folder.
  char program[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", program, sizeof program);
  const std::string path(program, length > 0 ? size_t(length) : 0);
  return path.substr(0, path.rfind('/') + 1);
}

std::string find_shared_file(const std::string& name) {
  const std::string library = library_folder();
  for (const char* up : {"../", "../../"}) {
    std::string path = concatenate(library, up, "share/maquette/", name);
    if (access(path.c_str(), F_OK) == 0) return path;
  }
  return "";
}

std::string module_path(const char* file) {
  const std::string library = library_folder();
  std::string of_program = concatenate(library, "../lib/maquette/", file);  // of one with the library inside
  std::string beside = concatenate(library, "maquette/", file);
  return access(beside.c_str(), F_OK) != 0 && access(of_program.c_str(), F_OK) == 0 ? of_program : beside;
}

LibraryOpening open_library(const std::string& path) {
  for (bool again = false;; again = true) {
    LibraryOpening opening{dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL), ""};
    if (opening.library != nullptr) return opening;
    if (const char* error = dlerror()) opening.error = error;
    const auto says = [&](const char* text) { return opening.error.find(text) != std::string::npos; };
    // glibc says the same of a file system whose programs may not run, and leaves no errno.
    if (says("failed to map segment")) require_memory(kLargestLibraryBytes);
    if (says("Too many open files")) {
      throw Error(MAQ_ERROR_OUT_OF_MEMORY, path,
                  " cannot be opened: the process or the system has too many open files. ",
                  "Close some, or raise the limit (ulimit -n).");
    }
    // Which is not of the process's memory: too many libraries with thread-local storage were opened.
    const bool is_static_storage = says("static TLS block");
    const bool is_told = says_out_of_memory(opening.error) && !is_static_storage;
    if (is_told) throw std::bad_alloc();
    require_memory(kThreadLocalBytes);
    // If glibc gives no reason, memory may have been short for a moment.
    if (again || access(path.c_str(), R_OK) != 0) return opening;
  }
}

void* find_symbol(void* library, const char* name) { return dlsym(library, name); }

void close_library(void* library) { dlclose(library); }

void* open_module(const char* file, const char* symbol, const char* needed_for, const char* remedy) {
  const std::string path = module_path(file);
  const auto [library, error] = open_library(path);
  if (library == nullptr) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, needed_for, " ", path, ", which cannot be opened: ", error, ". ", remedy);
  }
  const auto get_export = reinterpret_cast<ModuleExport (*)()>(find_symbol(library, symbol));
  const ModuleExport found = get_export == nullptr ? ModuleExport{"", nullptr} : get_export();
  if (found.object == nullptr || std::strcmp(found.version, sdk_version()) != 0) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, path, " is of version '", found.version, "', but this SDK is ",
                sdk_version(), ": install both from the same build.");
  }
  return found.object;
}

}  // namespace maq
