#include "terminal_size.h"

#include <sys/ioctl.h>

TerminalSize terminal_size(int descriptor) {
  TerminalSize size;
  winsize found{};
  if (ioctl(descriptor, TIOCGWINSZ, &found) != 0 || found.ws_col == 0) return size;
  size.columns = found.ws_col;
  if (found.ws_row > 0) size.rows = found.ws_row;
  return size;
}
