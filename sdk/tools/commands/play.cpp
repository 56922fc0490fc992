#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <maquette/maquette.hpp>
#include <memory>
#include <optional>

#include "arguments/source_argument.h"
#include "commands/commands.h"
#include "commands/play_statistics.h"
#include "interrupt.h"
#include "output/output_file.h"
#include "output/terminal_picture.h"
#include "print.h"

namespace {

struct PlayOptions {
  std::string source;
  double speed = 1;
  double from_s = 0;
  int64_t frames = 0;
  double seconds = 0;
  std::optional<bool> picture;
  std::string json;
  bool conceal = false;
  int32_t max_gap_ms = 300;
};

bool is_camera(const std::string& uri) {
  for (uint32_t i = 0; i < maq_source_get_scheme_count(); ++i) {
    maq_source_scheme scheme{};
    scheme.struct_size = sizeof scheme;
    maquette::check(maq_source_get_scheme(i, &scheme));
    if (uri.rfind(std::string(scheme.name) + ":", 0) == 0) return scheme.is_camera != 0;
  }
  return false;
}

std::string with_option(const std::string& uri, const std::string& key, const std::string& value) {
  return uri + (uri.find('?') == std::string::npos ? "?" : "&") + key + "=" + value;
}

int play(const PlayOptions& options) {
  require_writable(options.json);
  catch_interrupts();
  std::string uri = parse_source_argument(options.source).uri;
  if (!is_camera(uri)) {
    if (uri.find("live=") == std::string::npos) uri = with_option(uri, "live", "1");
    if (options.speed != 1) uri = with_option(uri, "speed", std::to_string(options.speed));
  }
  PlayStatistics statistics(options.frames);
  // Later events are in the statistics; a message would come between the lines of an image.
  std::atomic<bool> is_opening{true};
  maq_context_config log = maquette::default_context_config();
  log.log_user_data = &is_opening;
  log.log_callback = [](void* opening, maq_log_level, const char* text) {
    if (*static_cast<const std::atomic<bool>*>(opening)) print_error("maquette: %s\n", text);
  };
  const maquette::Context context(log);
  maq_source_config config = maquette::default_source_config();
  config.state_callback = PlayStatistics::note_state;
  config.state_user_data = &statistics;
  maquette::Source source(context, uri, &config);
#if MAQ_HAS_PREDICTION
  std::unique_ptr<maquette::Concealer> concealer;
  if (options.conceal) {
    maq_concealer_config how = maquette::default_concealer_config();
    how.max_gap_ms = options.max_gap_ms;
    concealer = std::make_unique<maquette::Concealer>(context, source, how);
  }
  const auto acquire = [&](int64_t timeout_ns, maq_frame** frame) {
    return concealer ? maq_concealer_acquire_frame(concealer->get(), timeout_ns, frame)
                     : maq_source_acquire_frame(source.get(), timeout_ns, frame);
  };
#else
  const auto acquire = [&](int64_t timeout_ns, maq_frame** frame) {
    return maq_source_acquire_frame(source.get(), timeout_ns, frame);
  };
#endif
  is_opening = false;
  std::optional<StoppedByInterrupt> stopped(source);
  if (options.from_s > 0) source.seek(int64_t(options.from_s * 1e9));

  const bool shows = options.picture.value_or(terminal_shows_pictures());
  TerminalPicture picture;
  std::string failure;
  const int64_t end_ns = options.seconds > 0 ? monotonic_ns() + int64_t(options.seconds * 1e9) : INT64_MAX;
  while (!interrupted() && monotonic_ns() < end_ns && (options.frames == 0 || statistics.frames() < options.frames)) {
    constexpr int64_t kPatienceNs = 250000000;  // how late --seconds may end while no frame comes
    maq_frame* taken = nullptr;
    const maq_status status = acquire(kPatienceNs, &taken);
    if (status == MAQ_TIMEOUT) continue;
    if (status == MAQ_END_OF_STREAM || status == MAQ_CANCELLED) break;
    if (status != MAQ_OK) {
      failure = maq_last_error(nullptr);
      break;
    }
    const maquette::Frame frame(taken);
    const maq_frame_desc desc = frame.desc();
    const maq_frame_origin origin = frame.origin();
    if (origin.kind == MAQ_FRAME_PREDICTED) {
      statistics.add_predicted();
    } else {
      statistics.add(desc);
    }
    if (!shows) continue;
    std::string line = statistics.line(source.info().dropped_frame_count);
    if (origin.kind == MAQ_FRAME_PREDICTED) {
      line += "  PREDICTED +" + std::to_string(origin.horizon_ns / 1000000) + " ms";
    }
    picture.show(frame, line);
  }
  const maq_source_info info = source.info();
  if (statistics.frames() == 0 && failure.empty() && !interrupted()) {
    failure = options.source + " delivered no frame before it ended or the time was up; dropped frames: " +
              std::to_string(info.dropped_frame_count) + ".";
  }
  stopped.reset();
#if MAQ_HAS_PREDICTION
  if (concealer) statistics.set_concealed(concealer->stats().late_count, concealer->stats().max_wait_ms);
  concealer.reset();
#endif
  statistics.close(std::move(source));
  statistics.print(info);
  if (!options.json.empty()) write_json_file(options.json, statistics.report(info), 1);
  if (!failure.empty()) print_error("maquette: %s\n", printable(failure).c_str());
  return failure.empty() && statistics.frames() > 0 ? 0 : 1;
}

}  // namespace

void add_play_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<PlayOptions>();
  CLI::App* command =
      app.add_subcommand("play", "Show a camera, a recording or another source, and count late and missing frames");
  command->add_option("source", options->source, "Source of the frames; see `maquette sources`")->required();
  command->add_option("-s,--speed", options->speed, "Speed of a recording, clip or stub: 2 is twice as fast")
      ->check(CLI::Range(0.01, 100.0));
  command->add_option("--from", options->from_s, "Start at this time of a recording or clip, in seconds")
      ->check(CLI::NonNegativeNumber);
  command->add_option("-n,--frames", options->frames, "Stop after N frames")->check(CLI::PositiveNumber);
  command->add_option("-t,--seconds", options->seconds, "Stop after this time, in seconds")->check(CLI::PositiveNumber);
  command->add_flag_callback(
      "--no-image", [=] { options->picture = false; }, "Print only statistics; default without a terminal");
#if MAQ_HAS_PREDICTION
  CLI::Option* conceal = command->add_flag(
      "--conceal", options->conceal, "Fill short gaps with predicted frames; the line below the image marks them");
  command->add_option("--max-gap", options->max_gap_ms, "Fill gaps of at most N milliseconds; default: 300")
      ->needs(conceal)
      ->check(CLI::Range(1, 10000));
#endif
  command->add_option("--json", options->json, "Write the statistics to this file");
  command->footer(
      "Plays frames in real time, also from files. A terminal shows the image in colour. Missing frames, late frames\n"
      "and interruptions are counted:\n\n"
      "  maquette play v4l2:/dev/video0\n"
      "  maquette play take.maqrec --from 5 --speed 0.5\n"
#if MAQ_HAS_PREDICTION
      "  maquette play 'stub:people?stall=300ms@3s' --conceal\n"
#endif
      "  maquette play 'stub:people?drop=0.1&unplug=3s@5s'");
  command->callback([=] { *exit_code = play(*options); });
}
