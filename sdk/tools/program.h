// What the programs of this folder have in common.
#pragma once

namespace CLI {
class App;
}

// Parses the arguments, which runs what they ask for, and returns the exit status: *exit_code, 1 after an exception,
// which is printed, 2 for wrong usage.
int run_program(CLI::App& app, int argc, char** argv, const int* exit_code);
