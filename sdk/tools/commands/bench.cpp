#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "commands/commands.h"

namespace {

constexpr int kPassedOn[] = {SIGINT, SIGTERM, SIGHUP};
volatile pid_t process = 0;

// A terminal sends its signals to both programs itself, and the second one would end the other program at once.
void pass_on(int number, siginfo_t* signal, void*) {
  if (signal->si_code <= 0) kill(process, number);
}

[[noreturn]] void become(const std::string& program, std::vector<std::string>& arguments, pid_t parent) {
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  // Where this program is killed, the other one ends too.
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() == parent) execv(program.c_str(), argv.data());
  std::fprintf(stderr, "maquette: %s cannot be started: %s. Install it beside maquette.\n", program.c_str(),
               std::strerror(errno));
  _exit(1);
}

// Started anew rather than by exec: a process keeps the moment of its start, from which the first result is counted.
int run_beside(const char* name, std::vector<std::string> arguments) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
  sigset_t passed_on, before;
  sigemptyset(&passed_on);
  for (const int number : kPassedOn) sigaddset(&passed_on, number);
  sigprocmask(SIG_BLOCK, &passed_on, &before);  // until the child runs, to which they go on
  const pid_t parent = getpid();
  process = fork();
  if (process < 0) throw std::runtime_error(program + " cannot be started: " + std::strerror(errno) + ".");
  if (process == 0) {
    sigprocmask(SIG_SETMASK, &before, nullptr);
    become(program, arguments, parent);
  }
  for (const int number : kPassedOn) {
    struct sigaction action {};
    sigaction(number, nullptr, &action);
    if (number == SIGHUP && action.sa_handler == SIG_IGN) continue;  // nohup(1)
    action.sa_sigaction = pass_on;
    action.sa_flags = SA_SIGINFO | SA_RESTART;
    sigaction(number, &action, nullptr);
  }
  sigprocmask(SIG_SETMASK, &before, nullptr);
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
