#include <CLI/CLI.hpp>
#include <cstdio>
#include <maquette/maquette.hpp>

#include "commands.h"

namespace {

int print_sources() {
  std::printf("Where frames can come from, with an example of each:\n\n");
  for (uint32_t i = 0; i < maq_source_scheme_count(); ++i) {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    maquette::check(maq_source_get_scheme(i, &scheme), nullptr);
    std::printf("  %-38s %s\n", scheme.example, scheme.summary);
  }
  std::printf("\n?size=640x480&fps=15 works on each. In a file name write ? as %%3F.\n");
  return 0;
}

}  // namespace

void add_sources_command(CLI::App& app, int* exit_code) {
  CLI::App* command = app.add_subcommand("sources", "List the kinds of sources of this build");
  command->callback([=] { *exit_code = print_sources(); });
}
