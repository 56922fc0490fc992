#include "program.h"

#include <CLI/CLI.hpp>
#include <exception>
#include <new>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "interrupt.h"
#include "own_program.h"
#include "print.h"
#include "standard_streams.h"

namespace {

constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;
constexpr int kOfSignals = 128;  // added to the number of a signal, as shells do for programs that signals end

// Returns the exit code of a run that failed or was cut short.
int failure() { return interrupted() ? kOfSignals + interrupting_signal() : kFailed; }

// Returns the fault of a word where a command is expected, or ""; CLI11 says only that a command is required.
std::string unknown_command(const CLI::App& app, int argc, char** argv) {
  const CLI::App* at = &app;
  std::string path = app.get_name().empty() ? "maquette" : app.get_name();
  for (int i = 1; i < argc && at->get_require_subcommand_min() > 0 && argv[i][0] != '-'; ++i) {
    const std::string word = argv[i];
    const auto found = at->get_subcommands([&](const CLI::App* command) { return command->check_name(word); });
    if (found.empty()) return "\"" + word + "\" is not a command; `" + path + " --help` lists them.";
    at = found.front();
    path += " " + word;
  }
  return "";
}

// Prints what CLI11 has to say: help, the version, or what is wrong with the arguments.
int answer(const CLI::App& app, const CLI::ParseError& error) {
  std::ostringstream out, err;
  const int exit_code = app.exit(error, out, err) == 0 ? 0 : kWrongUsage;
  print_error("%s", err.str().c_str());
  print_output("%s", out.str().c_str());
  return exit_code;
}

int parse(CLI::App& app, int argc, char** argv, const int* exit_code) {
  const std::string problem = unknown_command(app, argc, argv);
  if (!problem.empty()) {
    print_error("maquette: %s\n", printable(problem).c_str());
    return kWrongUsage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return answer(app, error);
  }
  return *exit_code;
}

}  // namespace

maquette::Context open_context() {
  maq_context_config config = maquette::default_context_config();
  config.log_callback = [](void*, maq_log_level, const char* text) { print_error("maquette: %s\n", text); };
  return maquette::Context(config);
}

int run_program(CLI::App& app, int argc, char** argv, const int* exit_code) {
  prepare_standard_streams();
  try {
    std::vector<std::string> arguments = own_arguments(argc, argv);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    const int result = parse(app, int(arguments.size()), pointers.data(), exit_code);
    flush_output();
    return result == kFailed ? failure() : result;
  } catch (const std::exception& error) {
    return report(error);
  }
}

int report(const std::exception& error) {
  std::string text = error.what();
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) text = "There is not enough memory.";
  const auto* of_system = dynamic_cast<const std::system_error*>(&error);
  if (of_system != nullptr && of_system->code() == std::errc::resource_unavailable_try_again) {
    text = "The system starts no more threads: raise the limit of this user (ulimit -u) or of the container.";
  }
  std::fflush(stdout);  // what was found before stands above the error also where both go to one file
  print_error("maquette: %s\n", printable(text).c_str());
  return failure();
}
