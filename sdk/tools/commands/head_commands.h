// The commands of `maquette head`.
#pragma once

#include <maquette/maquette.hpp>
#include <string>

namespace CLI {
class App;
}

void add_head_info_command(CLI::App& head, int* exit_code);

// "as heads are on average, give or take 4 %".
std::string text_of_scale(const maq_head_info& info);

// Between the pupils, in metres; 0 where the head has none.
double pupil_distance_m(const maquette::Head& head);
