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

// Throws std::runtime_error if files of two sources would have the same name.
std::vector<SourceArgument> parse_sources(const std::vector<std::string>& texts);

// Opens each source and calls `load` and `run` with it, until Ctrl-C. Errors of `load` are the command's. A source that
// cannot be opened, and an exception of `run`, are printed. The rest of a batch goes on, except after
// OutputLost. Returns the exit code.
int run_sources(const maquette::Context& context, const std::vector<SourceArgument>& arguments,
                const std::function<void(const maquette::Source&)>& load,
                const std::function<void(const SourceArgument&, maquette::Source&)>& run);

// A frame, and the beginning of its file names: in clips with its number.
struct SourceFrame {
  const maquette::Frame& frame;
  std::string stem;
};

// Whether the source has more than one image.
bool is_clip(const maquette::Source& source);

// Calls `work` with each frame within the limits, until Ctrl-C; it returns the text for the progress bar. The bar is
// there for clips, unless `quiet`. Returns how many there were.
int64_t run_frames(const SourceArgument& argument, maquette::Source& source, const FrameLimits& limits, bool quiet,
                   const std::function<std::string(const SourceFrame&)>& work);
