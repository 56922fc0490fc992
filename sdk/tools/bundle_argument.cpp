#include "bundle_argument.h"

#include <cstdlib>
#include <filesystem>

namespace fs = std::filesystem;

std::string default_bundle() {
  if (const char* from_environment = std::getenv("MAQ_BUNDLE")) {
    if (*from_environment != '\0') return from_environment;
  }
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return "";
  const fs::path bundle = program.parent_path().parent_path() / "share/maquette/models/densepose-b-int8";
  return fs::exists(bundle / "manifest.json", error) ? bundle.string() : "";
}
