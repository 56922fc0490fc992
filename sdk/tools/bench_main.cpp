// `maquette bench`: how long each stage of a frame takes on this machine.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "arguments/model_options.h"
#include "arguments/source_argument.h"
#include "interrupt.h"
#include "machine.h"
#include "output/output_file.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace {

constexpr const char* kSchema = "maquette-bench-3";
// Sources are measured alternately, in blocks of so many frames, so that a busy moment of the machine meets all of
// them.
constexpr int kBlock = 10;
constexpr double kMaxOthers = 0.05;  // of all cores: more, and the figures are of other processes too
constexpr double kMaxSpread = 1.5;   // p90 by p50
constexpr double kMibibyte = 1024.0 * 1024.0;

struct Options {
  std::vector<std::string> sources = {"stub:people?count=1", "stub:people?count=4", "stub:people?count=0"};
  ModelOptions model;
  std::string json;
  int warm_up = 10;
  int runs = 100;
  double seconds = 3;
};

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

double ms_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

// The stages of a frame in their order: taking it from the source, those of maq_densepose_stats, and all of it.
constexpr const char* kStages[] = {"capture",    "preprocess", "trunk",  "proposals", "box_head",
                                   "dense_head", "crops",      "decode", "frame"};
constexpr size_t kStageCount = std::size(kStages);

// One source with the times of its frames.
class Case {
 public:
  Case(const maquette::Context& context, std::string uri) : context_(context), uri_(std::move(uri)) { open(); }

  const std::string& uri() const { return uri_; }
  size_t runs() const { return ms_[0].size(); }
  double seconds() const { return seconds_; }

  // Takes the next frame, from the start again after the last one, and finds its people. Returns how long it took.
  // Nothing when the program was interrupted.
  std::optional<double> run(maquette::DensePose& densepose, bool counted) {
    const double cpu_before_s = own_processor_seconds();
    const auto start = Clock::now();
    std::optional<maquette::Frame> frame = source_->next();
    if (!frame && !interrupted()) {
      open();
      frame = source_->next();
    }
    if (!frame) {
      if (interrupted()) return std::nullopt;
      throw std::runtime_error(uri_ + " has no frames.");
    }
    const auto taken = Clock::now();
    const maquette::DensePoseResult result = densepose.run(*frame);
    const auto done = Clock::now();
    const maq_frame_desc desc = frame->desc();
    if (counted && last_sequence_ && desc.sequence > *last_sequence_)
      dropped_frames_ += desc.sequence - *last_sequence_ - 1;
    last_sequence_ = desc.sequence;
    const maq_densepose_stats stats = result.stats();
    stats_ = stats;
    size_px_ = {desc.width_px, desc.height_px};
    const double total_ms = ms_between(start, done);
    if (!counted) return total_ms;

    const double values[kStageCount] = {ms_between(start, taken), stats.preprocess_ms, stats.trunk_ms,
                                        stats.proposals_ms,       stats.box_head_ms,   stats.dense_head_ms,
                                        stats.crops_ms,           stats.decode_ms,     total_ms};
    for (size_t i = 0; i < kStageCount; ++i) ms_[i].push_back(values[i]);
    seconds_ += total_ms / 1e3;
    cpu_s_ += own_processor_seconds() - cpu_before_s;
    people_ += stats.person_count;
    return total_ms;
  }

  // Frames of a live source that pass between two blocks are not dropped ones.
  void pause() { last_sequence_.reset(); }

  double percentile(size_t stage, double percent) const {
    std::vector<double> sorted = ms_[stage];
    if (sorted.empty()) return 0;
    std::sort(sorted.begin(), sorted.end());
    const double at = percent / 100 * double(sorted.size() - 1);
    const size_t low = size_t(at);
    const size_t high = std::min(low + 1, sorted.size() - 1);
    return sorted[low] + (sorted[high] - sorted[low]) * (at - double(low));
  }
  double frame_ms() const { return percentile(kStageCount - 1, 50); }
  const maq_densepose_stats& latest() const { return stats_; }
  double people() const { return double(people_) / double(std::max<size_t>(1, runs())); }
  double cpu_ms() const { return 1e3 * cpu_s_ / double(std::max<size_t>(1, runs())); }

  // Why the times are unreliable; empty if they are not.
  std::vector<std::string> warnings(const Options& options) const {
    std::vector<std::string> reasons;
    char text[128];
    if (runs() < size_t(options.runs) || seconds_ < options.seconds) {
      std::snprintf(text, sizeof text, "%zu runs in %.1f s, %d and %.1f s asked for", runs(), seconds_, options.runs,
                    options.seconds);
      reasons.emplace_back(text);
    }
    const double spread = percentile(kStageCount - 1, 90) / std::max(1e-6, frame_ms());
    if (spread > kMaxSpread) {
      std::snprintf(text, sizeof text, "p90 is %.2f times p50, %.2f allowed", spread, kMaxSpread);
      reasons.emplace_back(text);
    }
    return reasons;
  }

  Json json(const Options& options) const {
    Json ms;
    for (size_t i = 0; i < kStageCount; ++i) {
      for (const int percent : {50, 90, 99}) {
        ms[kStages[i]]["p" + std::to_string(percent)] = rounded_ms(percentile(i, percent));
      }
    }
    const std::vector<std::string> reasons = warnings(options);
    return {{"source", uri_},
            {"size_px", size_px_},
            {"network_px", {stats_.network_width_px, stats_.network_height_px}},
            {"provider", name_of(stats_.provider)},
            {"threads", stats_.threads},
            {"threads_measured", stats_.is_threads_measured != 0},
            {"runs", runs()},
            {"seconds", seconds_},
            {"people", people()},
            {"proposals", stats_.proposal_count},
            {"dropped_frames", dropped_frames_},
            {"ms", ms},
            {"fps", 1e3 / std::max(1e-6, frame_ms())},
            {"cpu_ms", cpu_ms()},
            {"cores_busy", cpu_s_ / std::max(1e-6, seconds_)},
            {"valid", reasons.empty()},
            {"warnings", reasons}};
  }

 private:
  void open() {
    stopped_.reset();
    source_ = std::make_unique<maquette::Source>(context_, uri_);
    stopped_.emplace(*source_);
    last_sequence_.reset();
  }

  const maquette::Context& context_;
  std::string uri_;
  std::unique_ptr<maquette::Source> source_;
  std::optional<StoppedByInterrupt> stopped_;
  std::vector<double> ms_[kStageCount];
  maq_densepose_stats stats_{};
  std::array<int32_t, 2> size_px_{};
  std::optional<uint64_t> last_sequence_;
  double seconds_ = 0;
  double cpu_s_ = 0;
  int64_t people_ = 0;
  uint64_t dropped_frames_ = 0;
};

void print_table(const std::vector<std::unique_ptr<Case>>& cases) {
  size_t widest = 6;
  for (const auto& timed : cases) widest = std::max(widest, timed->uri().size());
  print_output("%-*s  people    FPS    p50    p90    p99 ms   CPU ms |", int(widest), "source");
  for (size_t i = 0; i + 1 < kStageCount; ++i) print_output(" %s", kStages[i]);
  print_output("\n");
  for (const auto& timed : cases) {
    print_output("%-*s  %6.2f %6.1f %6.1f %6.1f %6.1f %11.1f |", int(widest), timed->uri().c_str(), timed->people(),
                 1e3 / std::max(1e-6, timed->frame_ms()), timed->frame_ms(), timed->percentile(kStageCount - 1, 90),
                 timed->percentile(kStageCount - 1, 99), timed->cpu_ms());
    for (size_t i = 0; i + 1 < kStageCount; ++i) {
      print_output(" %*.1f", int(std::char_traits<char>::length(kStages[i])), timed->percentile(i, 50));
    }
    print_output("\n");
  }
}

int run_bench(const Options& options) {
  const std::string bundle = bundle_of(options.model);
  require_writable(options.json);
  const auto start = Clock::now();
  const maquette::Context context;
  const auto context_made = Clock::now();
  std::vector<std::unique_ptr<Case>> cases;
  for (const std::string& text : options.sources) {
    cases.push_back(std::make_unique<Case>(context, parse_source_argument(text).uri));
  }
  const auto sources_open = Clock::now();
  maquette::DensePose densepose(context, config_of(options.model, bundle));
  const double create_ms = ms_between(start, context_made) + ms_between(sources_open, Clock::now());

  const double first_frame_ms = *cases[0]->run(densepose, false);  // before interrupts are caught
  const double first_result_ms = 1e3 * seconds_since_start();

  catch_interrupts();
  for (const auto& timed : cases) {
    for (int i = 0; i < options.warm_up && !interrupted(); ++i) timed->run(densepose, false);
  }
  const double others_before_s = others_processor_seconds();
  const auto measured_from = Clock::now();
  ProgressBar progress("measuring", int64_t(cases.size()) * options.runs);
  const auto unfinished = [&](const Case& timed) {
    return timed.runs() < size_t(options.runs) || timed.seconds() < options.seconds;
  };
  int64_t done = 0;
  for (bool any = true; any && !interrupted();) {
    any = false;
    for (const auto& timed : cases) {
      if (!unfinished(*timed)) continue;
      any = true;
      timed->pause();
      densepose.reset();
      for (int i = 0; i < kBlock && !interrupted(); ++i) timed->run(densepose, true);
      done += kBlock;
      progress.advance(done, timed->uri());
    }
  }
  progress.finish();
  const double others_s = others_processor_seconds() - others_before_s;
  const double wall_s = ms_between(measured_from, Clock::now()) / 1e3;

  Json machine = describe_machine();
  const double others = std::max(0.0, others_s) / (std::max(1e-3, wall_s) * machine.at("cores").get<double>());
  std::vector<std::string> reasons;
  if (others > kMaxOthers) {
    char text[128];
    std::snprintf(text, sizeof text, "other processes used %.0f %% of the CPU", 100 * others);
    reasons.emplace_back(text);
  }
  Json document;
  document["schema"] = kSchema;
  document["machine"] = machine;
  document["build"] = {{"sdk", maq_get_sdk_version()},
                       {"commit", maq_get_git_commit()},
                       {"options", maq_get_build_options()},
                       {"onnxruntime", context.onnxruntime_version()}};
  document["bundle"] = bundle;
  const bool measures_threads = options.model.threads == MAQ_THREADS_MEASURED;
  document["settings"] = {{"threads", measures_threads ? Json("measured") : Json(options.model.threads)},
                          {"size", options.model.size},
                          {"threshold", options.model.threshold},
                          {"max_proposals", options.model.max_proposals},
                          {"key_frames", options.model.key_frames},
                          {"min_person_height_px", options.model.min_person_height_px},
                          {"crops", options.model.crops},
                          {"crop_size", options.model.crop_px},
                          {"surface", !options.model.no_surface},
                          {"spin", !options.model.no_spin},
                          {"provider", options.model.provider},
                          {"warm_up", options.warm_up},
                          {"runs", options.runs},
                          {"seconds", options.seconds}};
  document["create_ms"] = create_ms;
  document["first_frame_ms"] = first_frame_ms;
  document["start_to_first_result_ms"] = first_result_ms;
  document["peak_memory_mib"] = double(peak_memory_bytes()) / kMibibyte;
  document["other_processes_cpu_fraction"] = others;
  document["valid"] = reasons.empty();
  document["warnings"] = reasons;
  document["cases"] = Json::array();
  for (const auto& timed : cases) document["cases"].push_back(timed->json(options));

  print_table(cases);
  print_output("create %.0f ms, first frame %.0f ms, program start to first result %.0f ms, peak memory %.0f MiB\n",
               create_ms, first_frame_ms, first_result_ms, double(peak_memory_bytes()) / kMibibyte);
  if (measures_threads) print_output("Threads, measured: %d\n", cases[0]->latest().threads);
  for (const std::string& reason : reasons) print_output("Warning: %s\n", reason.c_str());
  for (const auto& timed : cases) {
    for (const std::string& reason : timed->warnings(options)) {
      print_output("Warning: %s: %s\n", timed->uri().c_str(), reason.c_str());
    }
  }
  if (!options.json.empty()) {
    write_json_file(options.json, document, 1);
    print_output("Written: %s\n", options.json.c_str());
  }
  return !interrupted() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app("Measure how long each stage of a frame takes on this machine", "maquette bench");
  Options options;
  app.add_option("source", options.sources,
                 "Images, clips or URIs, measured alternately; default: one, four and no people of stub:people");
  app.add_option("--json", options.json, "Also write everything to this file (docs/formats.md, \"Benchmarks\")");
  add_model_options(app, options.model);
  app.add_option("--warm-up", options.warm_up, "Frames of each source that are not counted (default 10)")
      ->check(CLI::Range(0, 100000));
  app.add_option("--runs", options.runs, "Minimum number of frames of each source (default 100)")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--seconds", options.seconds, "Minimum time of each source in seconds (default 3)")
      ->check(CLI::Range(0.0, 86400.0));
  app.footer(
      "A frame is counted from asking the source for it to having the result. CPU ms is the CPU time of all threads\n"
      "for one frame, a measure of its energy on every machine. Compare figures of one run; a warning says why\n"
      "times are unreliable: other processes busy, few runs, wide spread.\n\n"
      "Examples:\n"
      "  maquette bench\n"
      "  maquette bench 'stub:people?count=2&size=1280x720' clip.mp4 --threads 1 --json bench.json");
  int exit_code = 0;
  app.callback([&] { exit_code = run_bench(options); });
  return run_program(app, argc, argv, &exit_code);
} catch (const std::exception& error) {  // no memory for the options
  return report(error);
}
