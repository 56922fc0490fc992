// Finds the networks that are installed beside the library, and the program that reads clips.
#pragma once

#include <cstdint>
#include <maquette/maquette.hpp>
#include <string>

#include "arguments/bundle_argument.h"

struct InstalledNetworks {
  std::string path;  // "": not installed
  std::string precision;
  uint64_t bytes = 0;
  std::string problem;  // why they cannot be read; "": they can
};

// Loads the networks of a system as its commands do, so it takes some tenths of a second.
InstalledNetworks find_networks(const maquette::Context& context, const SystemNetworks& networks);

struct InstalledFfmpeg {
  std::string path;  // "": not found
  std::string version;
  std::string problem;  // "": none
};

// The program that MAQ_FFMPEG names, otherwise `ffmpeg` of the PATH.
InstalledFfmpeg find_ffmpeg();
