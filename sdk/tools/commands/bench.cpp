#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "commands/commands.h"
#include "machine.h"

// Another program takes the place of this one: it links only what an app links, so that it measures that.
void add_bench_command(CLI::App& app, int*) {
  CLI::App* command = app.add_subcommand("bench", "Measure how long each stage of a frame takes on this machine");
  command->prefix_command()->set_help_flag();
  command->callback([command] {
    const std::string program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "maquette-bench";
    std::vector<std::string> arguments = command->remaining();
    std::vector<char*> argv = {const_cast<char*>(program.c_str())};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    setenv(kStartVariable, std::to_string(seconds_since_boot()).c_str(), 1);
    execv(program.c_str(), argv.data());
    throw std::runtime_error(program + " cannot be started: " + std::strerror(errno) + ". Install it beside maquette.");
  });
}
