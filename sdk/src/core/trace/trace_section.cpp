#include "core/trace/trace_section.h"

#include <dlfcn.h>

namespace maq {
namespace {

// Functions of the NDK's <android/trace.h>.
struct TraceFunctions {
  bool (*is_enabled)() = nullptr;
  void (*begin_section)(const char*) = nullptr;
  void (*end_section)() = nullptr;
};

// On other systems only a library that is open already: a test's library.
#ifdef __ANDROID__
constexpr int kMode = RTLD_NOW;
#else
constexpr int kMode = RTLD_NOW | RTLD_NOLOAD;
#endif

// Without functions where the library is not there.
TraceFunctions find_functions() noexcept {
  TraceFunctions found;
  void* const library = dlopen("libandroid.so", kMode);
  if (library == nullptr) return found;
  found.begin_section = reinterpret_cast<void (*)(const char*)>(dlsym(library, "ATrace_beginSection"));
  found.end_section = reinterpret_cast<void (*)()>(dlsym(library, "ATrace_endSection"));
  if (found.begin_section == nullptr || found.end_section == nullptr) return found;
  found.is_enabled = reinterpret_cast<bool (*)()>(dlsym(library, "ATrace_isEnabled"));
  return found;
}

const TraceFunctions& functions() {
  static const TraceFunctions found = find_functions();
  return found;
}

}  // namespace

bool TraceSection::begin(const char* name) {
  const TraceFunctions& trace = functions();
  if (trace.is_enabled == nullptr || !trace.is_enabled()) return false;
  trace.begin_section(name);
  return true;
}

void TraceSection::end() {
  if (!is_open_) return;
  is_open_ = false;
  if (const auto end_section = functions().end_section) end_section();
}

}  // namespace maq
