// The `maquette` command line: each command is one file, built on the public C++ header alone.
#include <maquette/maquette.h>
#include <CLI/CLI.hpp>

#include "commands/commands.h"
#include "program.h"

int main(int argc, char** argv) try {
  CLI::App app(
      "Maquette: dense pose of people, edges in depth frames, heads and scenes from photos, and prediction of frames, "
      "on the CPU.");
  app.require_subcommand(1);
  app.allow_windows_style_options(false);  // "/" begins a path on all systems
  app.set_version_flag("--version", std::string("maquette ") + maq_get_sdk_version());
  app.footer(
#if MAQ_HAS_DENSEPOSE
      "Try it without a camera:\n  maquette densepose stub:people --out demo-output --overlay --max-frames 60\n"
      "Help on a command:\n  maquette densepose --help");
#else
      "Try it without a camera:\n  maquette play stub:people\nHelp on a command:\n  maquette play --help");
#endif
  int exit_code = 0;
  add_info_command(app, &exit_code);
  add_sources_command(app, &exit_code);
#if !defined(_WIN32)
  add_doctor_command(app, &exit_code);
#endif
  add_play_command(app, &exit_code);
#if MAQ_HAS_PREDICTION
  add_predict_command(app, &exit_code);
  add_health_command(app, &exit_code);
#endif
  add_record_command(app, &exit_code);
#if MAQ_HAS_DENSEPOSE
  add_densepose_command(app, &exit_code);
#endif
#if MAQ_HAS_DENSEPOSE && MAQ_HAS_BODY
  add_body_command(app, &exit_code);
#endif
#if MAQ_HAS_EDGES
  add_edges_command(app, &exit_code);
#endif
#if MAQ_HAS_HEADS
  add_head_command(app, &exit_code);
#endif
#if MAQ_HAS_SCENES
  add_scene_command(app, &exit_code);
#endif
#if MAQ_HAS_DENSEPOSE && !defined(_WIN32)
  add_bench_command(app, &exit_code);
#endif
  return run_program(app, argc, argv, &exit_code);
} catch (const std::exception& error) {  // no memory for the options
  return report(error);
}
