#include "own_program.h"

std::filesystem::path own_program_path() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error);
}

std::vector<std::string> own_arguments(int argc, char** argv) { return {argv, argv + argc}; }
