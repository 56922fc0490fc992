// The commands of `maquette edges`.
#pragma once

#include <string>

namespace CLI {
class App;
}

void add_edges_build_command(CLI::App& edges, int* exit_code);
void add_edges_info_command(CLI::App& edges, int* exit_code);

// `given`, or the bundle of the edge network that is used without. Throws std::runtime_error where there is none.
std::string edges_bundle_or_default(const std::string& given);
