#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "commands/commands.h"

namespace {

// Started anew rather than by exec: a process keeps the moment of its start, from which the first result is counted.
int run_beside(const char* name, std::vector<std::string> arguments) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::signal(SIGINT, SIG_IGN);  // the other program's to answer
  pid_t process = 0;
  const int error = posix_spawn(&process, program.c_str(), nullptr, nullptr, argv.data(), environ);
  if (error != 0) {
    throw std::runtime_error(program + " cannot be started: " + std::strerror(error) + ". Install it beside maquette.");
  }
  int status = 0;
  while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

void add_bench_command(CLI::App& app, int* exit_code) {
  CLI::App* command = app.add_subcommand("bench", "Measure how long each stage of a frame takes on this machine");
  command->prefix_command()->set_help_flag();
  command->callback([=] { *exit_code = run_beside("maquette-bench", command->remaining()); });
}
