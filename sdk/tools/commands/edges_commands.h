// The commands of `maquette edges`.
#pragma once

namespace CLI {
class App;
}

void add_edges_build_command(CLI::App& edges, int* exit_code);
void add_edges_info_command(CLI::App& edges, int* exit_code);
