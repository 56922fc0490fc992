// The path and the arguments of this program, as the system tells them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

// Returns the path of its file; "" where the system does not tell.
std::filesystem::path own_program_path();

// Returns its arguments in UTF-8, the name of the program first.
std::vector<std::string> own_arguments(int argc, char** argv);
