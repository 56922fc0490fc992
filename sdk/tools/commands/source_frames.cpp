#include "commands/source_frames.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <set>
#include <stdexcept>

#include "interrupt.h"
#include "output/progress_bar.h"
#include "print.h"

namespace {

constexpr int64_t kFramesOfEndlessSource = 100;

void tell(const std::exception& error) {
  flush_output();
  print_error("maquette: %s\n", printable(error.what()).c_str());
}

std::string numbered(const std::string& stem, uint64_t sequence) {
  char number[32];
  std::snprintf(number, sizeof number, "_%06llu", (unsigned long long)sequence);
  return stem + number;
}

}  // namespace

void add_frame_limits(CLI::App& command, FrameLimits& limits) {
  command
      .add_option("--max-frames", limits.max_frames, "Stop after N frames; default: all, or 100 of an endless source")
      ->check(CLI::Range(int64_t(1), int64_t(1) << 40));
  command.add_option("--every", limits.every, "Process only every N-th frame of a clip")
      ->check(CLI::Range(int64_t(1), int64_t(1) << 30));
}

std::vector<SourceArgument> parse_sources(const std::vector<std::string>& texts) {
  std::vector<SourceArgument> arguments;
  std::set<std::string> stems;
  for (const std::string& text : texts) {
    arguments.push_back(parse_source_argument(text));
    if (!stems.insert(arguments.back().stem).second) {
      throw std::runtime_error("Two sources would write files named " + arguments.back().stem +
                               "_…; run them one by one with different --out folders.");
    }
  }
  return arguments;
}

int run_sources(const maquette::Context& context, const std::vector<SourceArgument>& arguments,
                const std::function<void(const maquette::Source&)>& load,
                const std::function<void(const SourceArgument&, maquette::Source&)>& run) {
  catch_interrupts();
  int failed = 0;
  for (const SourceArgument& argument : arguments) {
    if (interrupted()) break;
    std::unique_ptr<maquette::Source> source;
    try {
      source = std::make_unique<maquette::Source>(context, argument.uri);
    } catch (const std::exception& error) {
      tell(error);
      ++failed;
      continue;
    }
    load(*source);
    try {
      run(argument, *source);
    } catch (const OutputLost&) {
      throw;
    } catch (const std::exception& error) {
      tell(error);
      ++failed;
    }
  }
  return failed == 0 && !interrupted() ? 0 : 1;
}

bool is_clip(const maquette::Source& source) { return source.info().frame_count != 1; }

int64_t run_frames(const SourceArgument& argument, maquette::Source& source, const FrameLimits& limits, bool quiet,
                   const std::function<std::string(const SourceFrame&)>& work) {
  const StoppedByInterrupt stopped(source);
  const maq_source_info info = source.info();
  const bool shows_progress = info.frame_count != 1 && !quiet;
  int64_t limit = limits.max_frames;
  const bool endless = info.frame_count < 0 && argument.uri.rfind("stub:", 0) == 0;
  if (limit == 0 && (endless || info.is_live != 0)) limit = kFramesOfEndlessSource;

  int64_t expected = info.frame_count < 0 ? limit : (info.frame_count + limits.every - 1) / limits.every;
  if (limit > 0) expected = expected > 0 ? std::min(expected, limit) : limit;
  ProgressBar progress(argument.stem, shows_progress ? expected : 1);
  int64_t done = 0;
  for (int64_t index = 0; !interrupted() && (limit == 0 || done < limit); ++index) {
    const auto frame = source.next();
    if (!frame) break;
    if (index % limits.every != 0) continue;
    const std::string stem = info.frame_count == 1 ? argument.stem : numbered(argument.stem, frame->desc().sequence);
    const std::string note = work({*frame, stem});
    ++done;
    if (shows_progress) progress.advance(done, note);
  }
  progress.finish();
  return done;
}
