// The commands of `maquette scene`.
#pragma once

#include <maquette/scene.h>
#include <nlohmann/json.hpp>
#include <string>

namespace CLI {
class App;
}

void add_scene_build_command(CLI::App& scene, int* exit_code);
void add_scene_render_command(CLI::App& scene, int* exit_code);

// Describes a scene file.
nlohmann::ordered_json describe_scene(const maq_scene_info& info, uint64_t file_bytes);
