#include "core/module.h"

#include <dlfcn.h>

#include <cstring>
#include <string>

#include "core/build_info.h"
#include "core/error.h"

namespace maq {

std::string library_folder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&library_folder), &info) == 0 || info.dli_fname == nullptr) return "";
  const std::string file = info.dli_fname;
  const size_t slash = file.rfind('/');
  return slash == std::string::npos ? "./" : file.substr(0, slash + 1);
}

std::string module_path(const char* file) { return library_folder() + "maquette/" + file; }

void* open_module(const char* file, const char* symbol, const char* needed_for, const char* remedy) {
  const std::string path = module_path(file);
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, needed_for, " ", path, ", which cannot be opened: ", dlerror(), ". ",
                remedy);
  }
  const auto get_export = reinterpret_cast<ModuleExport (*)()>(dlsym(library, symbol));
  const ModuleExport found = get_export == nullptr ? ModuleExport{"", nullptr} : get_export();
  if (found.object == nullptr || std::strcmp(found.version, sdk_version()) != 0) {
    throw Error(MAQ_ERROR_RUNTIME_LIBRARY, path, " is of version '", found.version, "', but this SDK is ",
                sdk_version(), ": install both from the same build.");
  }
  return found.object;
}

}  // namespace maq
