#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments/source_argument.h"
#include "commands/commands.h"
#include "interrupt.h"
#include "output/frame_image.h"
#include "output/health_image.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace {

struct HealthOptions {
  std::string source;
  std::string out;
  int64_t max_frames = 0;  // 0: to the end of the source
  bool json = false;
};

void print_json(const std::string& stem, const maq_frame_desc& desc, const maq_camera_health_result& result,
                double push_ms) {
  nlohmann::ordered_json line = {{"source", stem},
                                 {"frame", desc.sequence},
                                 {"timestamp_ns", desc.timestamp_ns},
                                 {"event", maq_camera_event_get_name(result.event)},
                                 {"state", maq_camera_event_get_name(result.state)},
                                 {"unexplained", result.unexplained},
                                 {"stream_start", result.is_stream_start != 0}};
  if (result.event != MAQ_CAMERA_OK) line["began_ns"] = result.began_ns;
  if (result.event == MAQ_CAMERA_OBJECT || result.event == MAQ_CAMERA_MOVED) {
    line["x_px"] = result.x_px;
    line["y_px"] = result.y_px;
  }
  line["ms"] = rounded_ms(push_ms);
  print_output("%s\n", json_text(line).c_str());
  flush_output();  // for programs that read line by line
}

void print_event(double time_s, const maq_frame_desc& desc, const maq_camera_health_result& result) {
  print_output("%9.2f s  frame %llu  %s", time_s, (unsigned long long)desc.sequence,
               maq_camera_event_get_name(result.event));
  if (result.event == MAQ_CAMERA_OBJECT) {
    print_output(" at (%.0f, %.0f)", double(result.x_px), double(result.y_px));
  }
  if (result.event == MAQ_CAMERA_MOVED) {
    print_output(": the picture moved by (%.0f, %.0f) px", double(result.x_px), double(result.y_px));
  }
  print_output("\n");
  flush_output();
}

// Where the frames or the events are drawn: a clip, a PNG file, or nothing.
class HealthOutput {
 public:
  HealthOutput(const maquette::Context& context, const std::string& path, double fps) : context_(context), path_(path) {
    if (path.empty()) return;
    const std::filesystem::path ending = std::filesystem::path(path).extension();
    if (ending != ".mp4" && ending != ".png") {
      throw std::runtime_error(path + " is no clip and no image; give a name that ends in .mp4 or .png.");
    }
    make_folder_of(path);
    if (ending == ".mp4") clip_.emplace(context, path, fps > 0 ? fps : 10);
  }

  void add(const maquette::Frame& frame, double time_s, const maq_camera_health_result& result,
           const std::vector<float>& map) {
    ++frames_;
    if (clip_) clip_->add(frame_of(context_, image_.draw(frame, result, map)));
    if (!clip_ && !path_.empty() && result.event != MAQ_CAMERA_OK) strip_.add(frame, time_s, result, map);
  }

  void finish() {
    if (clip_ && frames_ > 0) clip_->finish();
    if (clip_ || path_.empty()) return;
    const Canvas image = strip_.image();
    frame_of(context_, image).save(path_);
  }

 private:
  const maquette::Context& context_;
  const std::string path_;
  std::optional<maquette::Clip> clip_;
  HealthImage image_;
  EventStrip strip_;
  int64_t frames_ = 0;
};

int check_stream(const HealthOptions& options) {
  catch_interrupts();
  const SourceArgument argument = parse_source_argument(options.source);
  const maquette::Context context = open_context();
  maquette::Source source(context, argument.uri);
  const StoppedByInterrupt stopped(source);
  maquette::CameraHealth health(context);
  HealthOutput output(context, options.out, source.info().fps);
  int64_t frames = 0, first_ns = 0;
  while (!interrupted() && (options.max_frames == 0 || frames < options.max_frames)) {
    const auto frame = source.next();
    if (!frame) break;
    const maq_frame_desc desc = frame->desc();
    if (frames == 0) first_ns = desc.timestamp_ns;
    const maq_camera_health_result result = health.push(*frame);
    const double time_s = double(desc.timestamp_ns - first_ns) / 1e9;
    ++frames;
    output.add(*frame, time_s, result, health.map());
    if (options.json) {
      print_json(argument.stem, desc, result, double(health.stats().push_ms));
    } else if (result.event != MAQ_CAMERA_OK) {
      print_event(time_s, desc, result);
    }
  }
  output.finish();
  if (!options.json) {
    print_output("%s  %llu frames, %llu events%s%s\n", argument.stem.c_str(), (unsigned long long)frames,
                 (unsigned long long)health.stats().event_count, options.out.empty() ? "" : " -> ",
                 options.out.c_str());
  }
  return interrupted() && options.max_frames != 0 ? 1 : 0;
}

}  // namespace

void add_health_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<HealthOptions>();
  CLI::App* command = app.add_subcommand(
      "health", "Tell whether a camera is all right: cut, frozen, black, covered, moved, or an object before it");
  command->add_option("source", options->source, "Source of the frames; see `maquette sources`")->required();
  command->add_option("--max-frames", options->max_frames, "Stop after N frames; default: at the end, or at Ctrl-C")
      ->check(CLI::Range(int64_t(1), int64_t(1) << 40));
  command->add_option(
      "-o,--out", options->out,
      "Clip (.mp4): each frame with unexplained cells in red; or image (.png): the events side by side");
  command->add_flag("--json", options->json, "Print one JSON line a frame instead of the events");
  command->footer(
      "Events are cut (another scene), freeze (equal frames), black, and covered (detail is lost at once).\n"
      "Others are moved (the camera was knocked) and object (something is there that did not move in).\n\n"
      "Examples:\n"
      "  maquette health camera:                             # a line for each event\n"
      "  maquette health clip.mp4 --out events.png           # the events as one image\n"
      "  maquette health clip.mp4 --json > health.jsonl      # one line a frame");
  command->callback([=] { *exit_code = check_stream(*options); });
}
