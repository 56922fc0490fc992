#include "own_program.h"

#include <windows.h>
// Needs what windows.h declares.
#include <shellapi.h>

#include <new>

std::filesystem::path own_program_path() {
  std::wstring path(MAX_PATH, L'\0');
  DWORD length = 0;
  while ((length = ::GetModuleFileNameW(nullptr, path.data(), DWORD(path.size()))) == path.size()) {
    path.resize(2 * path.size());
  }
  path.resize(length);
  return path;
}

// The arguments of main() are in the code page of the user, which lacks most letters.
std::vector<std::string> own_arguments(int, char**) {
  int count = 0;
  wchar_t** const wide = ::CommandLineToArgvW(::GetCommandLineW(), &count);
  if (wide == nullptr) throw std::bad_alloc();
  std::vector<std::string> arguments;
  for (int i = 0; i < count; ++i) {
    const int bytes = ::WideCharToMultiByte(CP_UTF8, 0, wide[i], -1, nullptr, 0, nullptr, nullptr);
    std::string& text = arguments.emplace_back(size_t(bytes), '\0');
    ::WideCharToMultiByte(CP_UTF8, 0, wide[i], -1, text.data(), bytes, nullptr, nullptr);
    text.pop_back();  // its final zero
  }
  ::LocalFree(wide);
  return arguments;
}
