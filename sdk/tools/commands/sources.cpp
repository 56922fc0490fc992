#include <CLI/CLI.hpp>
#include <cstdio>
#include <maquette/maquette.hpp>

#include "commands/commands.h"
#include "print.h"

namespace {

void print_cameras() {
  const maquette::Context context;
  maq_camera_list* made = nullptr;
  maquette::check(maq_camera_list_create(context.get(), &made));
  const maquette::Owner<maq_camera_list, maq_camera_list_destroy> list(made);
  const uint32_t count = maq_camera_list_get_count(list.get());
  print_output(count == 0 ? "\nNo camera is plugged in.\n" : "\nCameras:\n");
  for (uint32_t i = 0; i < count; ++i) {
    maq_camera_info info{};
    info.struct_size = sizeof info;
    maquette::check(maq_camera_list_get_camera(list.get(), i, &info));
    print_output("\n  %-24s %s%s%s%s\n", info.uri, info.name, *info.bus != 0 ? " (" : "", info.bus,
                 *info.bus != 0 ? ")" : "");
    if (info.status != MAQ_OK) print_output("    %s\n", info.problem);
    for (uint32_t k = 0; k < info.mode_count; ++k) {
      maq_camera_mode mode{};
      mode.struct_size = sizeof mode;
      maquette::check(maq_camera_list_get_mode(list.get(), i, k, &mode));
      print_output("    %-5s %5d x %-5d", mode.format, mode.width_px, mode.height_px);
      if (mode.fps > 0) print_output(" up to %g frames a second", mode.fps);
      print_output("%s\n", mode.is_usable == 1 ? "" : "   not supported");
    }
  }
}

int print_sources() {
  print_output("Kinds of sources, with an example of each:\n\n");
  for (uint32_t i = 0; i < maq_source_get_scheme_count(); ++i) {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    maquette::check(maq_source_get_scheme(i, &scheme));
    print_output("  %-38s %s\n", scheme.example, scheme.summary);
  }
  print_output("\n?size=640x480&fps=15 works with each. In a file name, write ? as %%3F.\n");
  print_cameras();
  return 0;
}

}  // namespace

void add_sources_command(CLI::App& app, int* exit_code) {
  CLI::App* command =
      app.add_subcommand("sources", "List the kinds of sources in this build, and the connected cameras");
  command->callback([=] { *exit_code = print_sources(); });
}
