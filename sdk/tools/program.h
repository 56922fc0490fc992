// Shared by the programs of this folder.
#pragma once

#include <exception>
#include <maquette/maquette.hpp>

namespace CLI {
class App;
}

// A context whose warnings go to standard error.
maquette::Context open_context();

// Parses the arguments, runs the command, and returns the exit status: *exit_code, 1 after an exception, which is
// printed, and where standard output is lost, 2 for wrong usage.
int run_program(CLI::App& app, int argc, char** argv, const int* exit_code);

// Prints the text of an exception, and returns its exit status.
int report(const std::exception& error);
