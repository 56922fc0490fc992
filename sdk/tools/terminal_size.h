// The size of a terminal that the program writes to.
#pragma once

struct TerminalSize {
  int columns = 80, rows = 24;
};

// `descriptor`: of standard output or standard error. Returns the default where it is no terminal or has no size.
TerminalSize terminal_size(int descriptor);
