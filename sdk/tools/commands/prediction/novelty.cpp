#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments/bundle_argument.h"
#include "arguments/source_argument.h"
#include "commands/commands.h"
#include "interrupt.h"
#include "output/frame_image.h"
#include "output/novelty_image.h"
#include "output/output_file.h"
#include "print.h"
#include "program.h"

namespace {

struct NoveltyOptions {
  std::string source;
  std::string bundle;
  std::string out;
  double threshold = 4;
  int64_t max_frames = 0;  // 0: to the end of the source
  int threads = 0;
  bool json = false;
};

// The cell of the map with the most bits.
struct Peak {
  double x_px = 0, y_px = 0;  // its middle in the frame
  float bits = 0;
};

Peak peak_of(const std::vector<float>& map, const maq_novelty_score& score, const maq_frame_desc& desc) {
  const auto most = std::max_element(map.begin(), map.end());
  const auto cell = int32_t(most - map.begin());
  const int32_t column = cell % score.columns, row = cell / score.columns;
  return {(column + 0.5) * desc.width_px / score.columns, (row + 0.5) * desc.height_px / score.rows, *most};
}

// A line on a terminal that is drawn again with each frame: bits on a logarithmic scale.
class NoveltyMeter {
 public:
  NoveltyMeter() : is_visible_(isatty(STDERR_FILENO) != 0) {}
  ~NoveltyMeter() { clear(); }
  NoveltyMeter(const NoveltyMeter&) = delete;
  NoveltyMeter& operator=(const NoveltyMeter&) = delete;

  void show(double time_s, const maq_novelty_score& score) {
    const auto now = std::chrono::steady_clock::now();
    if (!is_visible_ || now - last_drawn_ < kRedraw) return;
    last_drawn_ = now;
    is_drawn_ = true;
    const double share = std::log(double(score.bits) / kMinBits) / std::log(kMaxBits / kMinBits);
    const int filled = int(std::lround(kWidth * std::clamp(share, 0.0, 1.0)));
    std::string bar;
    for (int i = 0; i < kWidth; ++i) bar += i < filled ? "█" : "░";
    std::fprintf(stderr, "\r%9.2f s  %s  %5.2f bits a code  x %.2f\x1b[K", time_s, bar.c_str(), double(score.bits),
                 double(score.ratio));
    std::fflush(stderr);
  }
  // Clears the line for the next text.
  void clear() {
    if (is_drawn_) std::fputs("\r\x1b[K", stderr);
    is_drawn_ = false;
    last_drawn_ = {};
  }

 private:
  static constexpr int kWidth = 30;
  static constexpr double kMinBits = 0.03, kMaxBits = 10;
  static constexpr std::chrono::milliseconds kRedraw{80};

  const bool is_visible_;
  bool is_drawn_ = false;
  std::chrono::steady_clock::time_point last_drawn_{};
};

void print_json(const std::string& stem, const maq_frame_desc& desc, const maq_novelty_score& score, const Peak& peak,
                double push_ms) {
  const nlohmann::ordered_json line = {{"source", stem},
                                       {"frame", desc.sequence},
                                       {"timestamp_ns", desc.timestamp_ns},
                                       {"bits", score.bits},
                                       {"ratio", score.ratio},
                                       {"event", score.is_event != 0},
                                       {"cut", score.is_cut != 0},
                                       {"stream_start", score.is_stream_start != 0},
                                       {"peak", {{"x_px", peak.x_px}, {"y_px", peak.y_px}, {"bits", peak.bits}}},
                                       {"ms", rounded_ms(push_ms)}};
  print_output("%s\n", json_text(line).c_str());
  flush_output();  // for programs that read line by line
}

void print_event(double time_s, const maq_frame_desc& desc, const maq_novelty_score& score, const Peak& peak) {
  print_output("%9.2f s  frame %llu  x %.2f  %.2f bits a code", time_s, (unsigned long long)desc.sequence,
               double(score.ratio), double(score.bits));
  if (score.is_cut != 0) print_output("  cut");
  if (score.is_cut == 0 && score.ratio > 1) print_output("  most at (%.0f, %.0f)", peak.x_px, peak.y_px);
  print_output("\n");
  flush_output();
}

// Returns no clip for "".
std::optional<maquette::Clip> open_clip(const maquette::Context& context, const std::string& path, double fps) {
  if (path.empty()) return std::nullopt;
  if (std::filesystem::path(path).extension() != ".mp4") {
    throw std::runtime_error(path + " is no clip; give a name that ends in .mp4.");
  }
  make_folder_of(path);
  return maquette::Clip(context, path, fps > 0 ? fps : 10);
}

maquette::Novelty make_novelty(const maquette::Context& context, const NoveltyOptions& options) {
  const std::string bundle = bundle_or_default(kPredictionNetworks, options.bundle);
  maq_novelty_config config = maquette::default_novelty_config();
  config.model.bundle_path = bundle.c_str();
  config.model.threads = options.threads;
  config.event_ratio = float(options.threshold);
  return maquette::Novelty(context, config);
}

void print_summary(const std::string& stem, const maquette::Novelty& novelty, double bits, const std::string& out) {
  const maq_novelty_stats stats = novelty.stats();
  const uint64_t compared = stats.pushed_count - stats.stream_start_count;
  print_output("%s  %llu frames, %.2f bits a code in the mean, %llu events%s%s\n", stem.c_str(),
               (unsigned long long)stats.pushed_count, compared > 0 ? bits / double(compared) : 0,
               (unsigned long long)stats.event_count, out.empty() ? "" : " -> ", out.c_str());
}

int score_stream(const NoveltyOptions& options) {
  catch_interrupts();
  const SourceArgument argument = parse_source_argument(options.source);
  const maquette::Context context = open_context();
  maquette::Source source(context, argument.uri);
  const StoppedByInterrupt stopped(source);
  maquette::Novelty novelty = make_novelty(context, options);
  std::optional<maquette::Clip> clip = open_clip(context, options.out, source.info().fps);
  NoveltyImage image;
  NoveltyMeter meter;
  int64_t frames = 0, first_ns = 0;
  double bits = 0;
  while (!interrupted() && (options.max_frames == 0 || frames < options.max_frames)) {
    const auto frame = source.next();
    if (!frame) break;
    const maq_frame_desc desc = frame->desc();
    if (frames == 0) first_ns = desc.timestamp_ns;
    const maq_novelty_score score = novelty.push(*frame);
    const std::vector<float> map = novelty.map();
    const Peak peak = peak_of(map, score, desc);
    const double time_s = double(desc.timestamp_ns - first_ns) / 1e9;
    ++frames;
    if (clip) clip->add(frame_of(context, image.draw(*frame, novelty.reconstruction(), score, map)));
    if (score.is_stream_start == 0) bits += double(score.bits);
    if (options.json) {
      print_json(argument.stem, desc, score, peak, double(novelty.stats().push_ms));
    } else if (score.is_event != 0) {
      meter.clear();
      print_event(time_s, desc, score, peak);
    }
    meter.show(time_s, score);
  }
  meter.clear();
  if (clip && frames > 0) clip->finish();
  if (!options.json) print_summary(argument.stem, novelty, bits, options.out);
  return interrupted() && options.max_frames != 0 ? 1 : 0;
}

}  // namespace

void add_novelty_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<NoveltyOptions>();
  CLI::App* command =
      app.add_subcommand("novelty", "Score how unexpected each frame of a clip or camera is, and report events");
  command->add_option("source", options->source, "Source of the frames; see `maquette sources`")->required();
  command
      ->add_option("--threshold", options->threshold,
                   "Ratio of an event: N times the bits of the 8 frames before, or 1/N of them; default: 4")
      ->check(CLI::Range(1.001, 1e6));
  command->add_option("--max-frames", options->max_frames, "Stop after N frames; default: at the end, or at Ctrl-C")
      ->check(CLI::Range(int64_t(1), int64_t(1) << 40));
  command->add_option("--bundle", options->bundle,
                      "Folder of the networks; default: MAQ_PREDICTION_BUNDLE, then the installed bundle");
  command->add_option("-t,--threads", options->threads, "Threads of the networks; default: the large cores, at most 4")
      ->check(CLI::Range(0, 64));
  command->add_option("-o,--out", options->out,
                      "Clip (.mp4): each frame with novel cells in red, its reconstruction, and the curve");
  command->add_flag("--json", options->json, "Print one JSON line a frame instead of the events");
  command->footer(
      "The score is in bits a code: about 0.03 when nothing changes, 1 to 3 when much moves, above 8 for a new scene.\n"
      "A frame is an event when its score differs much from the frames before: a cut, a frozen or covered camera,\n"
      "an object that appears. A terminal shows a meter.\n\n"
      "Examples:\n"
      "  maquette novelty camera: --threshold 6              # cuts, a frozen or covered camera\n"
      "  maquette novelty clip.mp4 --out novelty.mp4         # the map and the curve as a clip\n"
      "  maquette novelty clip.mp4 --json > scores.jsonl     # one line a frame");
  command->callback([=] { *exit_code = score_stream(*options); });
}
