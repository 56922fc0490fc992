// A source as the user writes it, and the names of the files made from it.
#pragma once

#include <string>

struct SourceArgument {
  std::string uri;
  std::string stem;  // of output files: "photo" for image:dir/photo.jpg, "stub_people" for stub:people?count=2
};

// Takes a URI as it is, and a bare path as file:.
// Throws std::runtime_error when a bare path does not exist.
SourceArgument parse_source_argument(const std::string& text);
