// Runs the `maquette` program in a folder and tells what it said.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "support/temp_folder.h"

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

// Runs lines of a shell, in which `maquette` is the program. `environment`: assignments for it.
inline Outcome run_shell(const TempFolder& folder, const std::string& environment, const std::string& script) {
  const std::string command = "cd '" + folder.path().string() + "' && maquette() { " + environment +
                              " " MAQ_TEST_EMULATOR " '" MAQ_TEST_CLI "' \"$@\"; }; {\n" + script +
                              "\n} >out.txt 2>err.txt";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(folder.file("out.txt")),
          read_text(folder.file("err.txt"))};
}

inline Outcome run_program(const TempFolder& folder, const std::string& environment, const std::string& arguments) {
  return run_shell(folder, environment, "maquette " + arguments);
}
