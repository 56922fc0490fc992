// The frames of the sources that a command is given, one source after the other.
#pragma once

#include <cstdint>
#include <functional>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

#include "arguments/source_argument.h"

namespace CLI {
class App;
}

struct FrameLimits {
  int64_t max_frames = 0;  // 0: all, or 100 of an endless source
  int64_t every = 1;
};

// --max-frames and --every.
void add_frame_limits(CLI::App& command, FrameLimits& limits);

// Throws std::runtime_error for two of which files would have one name.
std::vector<SourceArgument> parse_sources(const std::vector<std::string>& texts);

// Opens each source and calls `run` with it, until Ctrl-C; before the first, `load`, whose errors are the command's.
// What cannot be opened, and what `run` throws, is printed and does not cost the rest of a batch, but for OutputLost.
// Returns the exit code.
int run_sources(const maquette::Context& context, const std::vector<SourceArgument>& arguments,
                const std::function<void()>& load,
                const std::function<void(const SourceArgument&, maquette::Source&)>& run);

// A frame, and what the names of its files begin with: of clips with its number.
struct SourceFrame {
  const maquette::Frame& frame;
  std::string stem;
};

// Whether the source has more than one picture.
bool is_clip(const maquette::Source& source);

// Calls `work` with each frame within the limits, until Ctrl-C; it returns what the progress bar says of it. The bar is
// there for clips, unless `quiet`. Returns how many there were.
int64_t run_frames(const SourceArgument& argument, maquette::Source& source, const FrameLimits& limits, bool quiet,
                   const std::function<std::string(const SourceFrame&)>& work);
