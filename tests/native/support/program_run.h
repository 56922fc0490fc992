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

// `environment`: assignments for the shell.
inline Outcome run_program(const TempFolder& folder, const std::string& environment, const std::string& arguments) {
  const std::string command = "cd '" + folder.path().string() + "' && " + environment +
                              " " MAQ_TEST_EMULATOR " '" MAQ_TEST_CLI "' " + arguments + " >out.txt 2>err.txt";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(folder.file("out.txt")),
          read_text(folder.file("err.txt"))};
}
