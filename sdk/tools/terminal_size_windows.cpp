#include "terminal_size.h"

#include <io.h>
#include <windows.h>

TerminalSize terminal_size(int descriptor) {
  CONSOLE_SCREEN_BUFFER_INFO found{};
  const auto terminal = reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor));
  if (::GetConsoleScreenBufferInfo(terminal, &found) == 0) return {};
  return {found.srWindow.Right - found.srWindow.Left + 1, found.srWindow.Bottom - found.srWindow.Top + 1};
}
