#include "standard_streams.h"

#include <fcntl.h>
#include <io.h>
#include <windows.h>

#include <cstdio>

// Texts are UTF-8, and what is written to files is the same on all systems: "\n" ends a line.
void prepare_standard_streams() {
  ::SetConsoleOutputCP(CP_UTF8);
  for (FILE* stream : {stdout, stderr}) ::_setmode(::_fileno(stream), _O_BINARY);
}
