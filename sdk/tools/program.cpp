#include "program.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>

namespace {

constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

}  // namespace

maquette::Context open_context() {
  maq_context_config config = maquette::default_context_config();
  config.log_callback = [](void*, maq_log_level, const char* text) { std::fprintf(stderr, "maquette: %s\n", text); };
  return maquette::Context(config);
}

int run_program(CLI::App& app, int argc, char** argv, const int* exit_code) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongUsage;
  } catch (const std::exception& error) {
    return report(error);
  }
  return *exit_code;
}

int report(const std::exception& error) {
  const bool is_memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  std::fprintf(stderr, "maquette: %s\n", is_memory ? "There is not enough memory." : error.what());
  return kFailed;
}
