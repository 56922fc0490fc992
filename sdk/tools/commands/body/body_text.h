// Bodies as people and programs read them: a table, and a line of JSON for each frame.
#pragma once

#include <cstdint>
#include <map>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

// The latest sizes of each person, by id.
using SizesOfPeople = std::map<int64_t, maq_body_sizes>;

// Returns a frame as one JSON object without a line end: of each person angles, keypoints and sizes. `people` are those
// of `fitted`.
std::string json_of_frame(const std::string& stem, const maq_frame_desc& desc,
                          const std::vector<maq_body_person>& people, const maquette::BodyResult& fitted);

// Prints a line of angles for each fitted person. Throws OutputLost.
void print_angles(const std::vector<maq_body_person>& people);

// Prints a row of sizes in centimetres for each person, with their intervals; nothing without people. Throws
// OutputLost.
void print_sizes(const SizesOfPeople& sizes);
