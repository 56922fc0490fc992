// The commands of `maquette`. Each adds itself to the app; its exit code, if not 0, goes to `*exit_code`, and its
// exception is printed as its error.
#pragma once

namespace CLI {
class App;
}

void add_info_command(CLI::App& app, int* exit_code);
void add_sources_command(CLI::App& app, int* exit_code);
void add_doctor_command(CLI::App& app, int* exit_code);
void add_play_command(CLI::App& app, int* exit_code);
void add_predict_command(CLI::App& app, int* exit_code);
void add_health_command(CLI::App& app, int* exit_code);
void add_record_command(CLI::App& app, int* exit_code);
void add_body_command(CLI::App& app, int* exit_code);
void add_densepose_command(CLI::App& app, int* exit_code);
void add_edges_command(CLI::App& app, int* exit_code);
void add_head_command(CLI::App& app, int* exit_code);
void add_scene_command(CLI::App& app, int* exit_code);
void add_bench_command(CLI::App& app, int* exit_code);
