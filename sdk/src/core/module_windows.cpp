#include <windows.h>

#include "core/error.h"
#include "core/module.h"
#include "core/wide_path.h"

namespace maq {
namespace {

bool is_there(const std::string& path) {
  return ::GetFileAttributesW(wide_path(path).c_str()) != INVALID_FILE_ATTRIBUTES;
}

}  // namespace

std::string library_folder() {
  HMODULE module = nullptr;
  constexpr DWORD kOfAddress = GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT;
  if (::GetModuleHandleExW(kOfAddress, reinterpret_cast<LPCWSTR>(&library_folder), &module) == 0) return "";
  std::wstring path(MAX_PATH, L'\0');
  DWORD length = 0;
  while ((length = ::GetModuleFileNameW(module, path.data(), DWORD(path.size()))) == path.size()) {
    path.resize(2 * path.size());
  }
  path.resize(length);
  const std::string file = std::filesystem::path(path).generic_u8string();  // with '/'
  return file.substr(0, file.rfind('/') + 1);
}

// Libraries lie beside programs, in bin/.
std::string find_shared_file(const std::string& name) {
  const std::string path = concatenate(library_folder(), "../share/maquette/", name);
  return is_there(path) ? path : "";
}

std::string module_path(const char* file) {
  std::string beside = concatenate(library_folder(), file);
  std::string of_package = concatenate(library_folder(), "../lib/maquette/", file);
  return is_there(beside) ? beside : of_package;
}

// A library in a named folder finds the libraries that lie beside it; others are searched for where Windows does.
LibraryOpening open_library(const std::string& path) {
  const bool has_folder = path.find_first_of("/\\") != std::string::npos;
  const std::filesystem::path file = std::filesystem::u8path(path);
  const std::wstring name = has_folder ? std::filesystem::absolute(file).make_preferred().wstring() : file.wstring();
  const DWORD flags = has_folder ? LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR | LOAD_LIBRARY_SEARCH_DEFAULT_DIRS : 0;
  LibraryOpening opening{::LoadLibraryExW(name.c_str(), nullptr, flags), ""};
  if (opening.library != nullptr) return opening;
  const DWORD error = ::GetLastError();
  if (error == ERROR_NOT_ENOUGH_MEMORY || error == ERROR_OUTOFMEMORY) throw std::bad_alloc();
  const char* reason = "";
  if (error == ERROR_MOD_NOT_FOUND) reason = " (the file, or a library that it needs, is not there)";
  if (error == ERROR_BAD_EXE_FORMAT) reason = " (it is not a library for this processor)";
  opening.error = concatenate(path, ": error ", error, " of Windows", reason);
  return opening;
}

void* find_symbol(void* library, const char* name) {
  return reinterpret_cast<void*>(::GetProcAddress(static_cast<HMODULE>(library), name));
}

void close_library(void* library) { ::FreeLibrary(static_cast<HMODULE>(library)); }

}  // namespace maq
