#include "graphics/ndk_graphics.h"

#include <dlfcn.h>

#include <string>
#include <type_traits>

#include "status_error.h"

namespace maq_jni {

#if __has_include(<android/native_window.h>)
#define MAQ_FUNCTION(name, signature) static_assert(std::is_same_v<signature, decltype(::name)>, #name);
MAQ_FUNCTIONS_OF_NATIVEWINDOW(MAQ_FUNCTION)
#undef MAQ_FUNCTION
#endif

void* open_android_library(const char* name) {
  void* const library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
  if (library != nullptr) return library;
  throw StatusError{MAQ_ERROR_RUNTIME_LIBRARY,
                    std::string("Pictures of Android need ") + name + ", which cannot be opened: " + dlerror() + "."};
}

void* find_android_function(void* library, const char* name) {
  void* const function = dlsym(library, name);
  if (function != nullptr) return function;
  throw StatusError{MAQ_ERROR_RUNTIME_LIBRARY,
                    std::string("Pictures of Android need the function ") + name + " of Android 8 (API level 26)."};
}

const GraphicsFunctions& graphics_functions() {
  static const GraphicsFunctions found = [] {
    void* const library = open_android_library("libnativewindow.so");
    GraphicsFunctions functions;
#define MAQ_FUNCTION(name, signature) \
  functions.name = reinterpret_cast<decltype(functions.name)>(find_android_function(library, #name));
    MAQ_FUNCTIONS_OF_NATIVEWINDOW(MAQ_FUNCTION)
#undef MAQ_FUNCTION
    functions.AHardwareBuffer_lockPlanes =
        reinterpret_cast<decltype(functions.AHardwareBuffer_lockPlanes)>(dlsym(library, "AHardwareBuffer_lockPlanes"));
    return functions;
  }();  // tried again when it throws
  return found;
}

}  // namespace maq_jni
