#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <stdexcept>

#include "arguments/source_argument.h"
#include "commands/commands.h"
#include "interrupt.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace {

struct RecordOptions {
  std::string source;
  std::string out;
  int64_t frames = 0;
  double seconds = 0;
  uint32_t quality = 0;
  bool keep_predicted = false;
};

// Frames that may wait while the disk is slow.
constexpr uint32_t kWaitingFrames = 30;

int record(const RecordOptions& options) {
  catch_interrupts();
  const maquette::Context context = open_context();
  maq_source_config config = maquette::default_source_config();
  config.queue_length = kWaitingFrames;
  const SourceArgument argument = parse_source_argument(options.source);
  maquette::Source source(context, argument.uri, &config);
  const StoppedByInterrupt stopped(source);
  const maq_source_info info = source.info();
  if (info.frame_count < 0 && info.is_live == 0 && options.frames == 0 && options.seconds == 0) {
    throw std::runtime_error(argument.uri + " has no end; set a limit with --frames or --seconds.");
  }
  maq_recorder_config how{};
  maquette::check(maq_recorder_config_init(&how, sizeof how));
  how.jpeg_quality = options.quality;
  how.keep_predicted = options.keep_predicted ? 1 : 0;
  maquette::Recorder recorder(context, options.out, &source, &how);

  int64_t expected = options.frames > 0 ? options.frames : std::max<int64_t>(0, info.frame_count);
  if (options.seconds > 0) {
    const auto of_time = int64_t(options.seconds * info.fps);
    expected = expected == 0 ? of_time : std::min(expected, of_time);
  }
  ProgressBar progress(argument.stem, expected);
  int64_t first_ns = 0, last_ns = 0;
  int64_t done = 0;
  while (!interrupted() && (options.frames == 0 || done < options.frames)) {
    const auto frame = source.next();
    if (!frame) break;
    last_ns = frame->desc().timestamp_ns;
    if (done == 0) first_ns = last_ns;
    if (options.seconds > 0 && double(last_ns - first_ns) >= options.seconds * 1e9) break;
    recorder.add(*frame);
    ++done;
    char note[64];
    std::snprintf(note, sizeof note, "%.1f MB, %" PRIu64 " dropped", double(recorder.info().size_bytes) / 1e6,
                  source.info().dropped_frame_count);
    progress.advance(done, note);
  }
  progress.finish();
  if (done == 0) throw std::runtime_error(argument.uri + " delivered no frame, so nothing was recorded.");
  recorder.finish();
  print_output("%s: %" PRId64 " frames, %.1f s, %.1f MB, %" PRIu64 " dropped. To watch it: maquette play %s\n",
               options.out.c_str(), done, double(last_ns - first_ns) / 1e9, double(recorder.info().size_bytes) / 1e6,
               source.info().dropped_frame_count, options.out.c_str());
  return 0;
}

}  // namespace

void add_record_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand("record", "Record a camera or another source to a file");
  command->add_option("source", options->source, "Source of the frames; see `maquette sources`")->required();
  command->add_option("out", options->out, "File of the recording: take.maqrec; must not exist yet")->required();
  command->add_option("-n,--frames", options->frames, "Stop after N frames")->check(CLI::PositiveNumber);
  command->add_option("-t,--seconds", options->seconds, "Stop after this time, in seconds")->check(CLI::PositiveNumber);
  command
      ->add_option("-q,--quality", options->quality,
                   "Compress frames as JPEG of this quality, 1 to 100; default: store them unchanged")
      ->check(CLI::Range(1, 100));
  command->add_flag("--keep-predicted", options->keep_predicted,
                    "Also record predicted frames, with a mark; default: they are an error");
  command->footer(
      "Frames keep their times, numbers, depth and intrinsics. Ctrl-C ends a recording. A recording can be played "
      "even\n"
      "after a crash or a power cut.\n\n"
      "  maquette record v4l2:/dev/video0 take.maqrec --seconds 10\n"
      "  maquette densepose take.maqrec --out results --overlay\n"
      "  maquette play 'rec:take.maqrec?from=2&speed=0.5'");
  command->callback([=] { *exit_code = record(*options); });
}
