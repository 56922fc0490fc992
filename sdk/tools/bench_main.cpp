// `maquette bench`: how long each stage of a frame takes on this machine.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include "arguments/densepose_options.h"
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
constexpr double kMibibyte = 1024.0 * 1024.0;
constexpr double kMaxOthers = 0.05;  // of all cores: more, and the figures are of other processes too
constexpr double kMaxSpread = 1.5;   // p90 by p50

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

// The stages of a frame in their order: taking it from the source, those of maq_densepose_stats, and all of it.
const std::vector<const char*> kStages = {"capture",    "preprocess", "trunk",  "proposals", "box_head",
                                          "dense_head", "crops",      "decode", "frame"};

// Times of the stages of one source, run by run, and why they may be unreliable.
class StageTimes {
 public:
  // A run: a time for each stage, all of the run last, and the CPU time of all threads meanwhile.
  void add(const std::vector<double>& ms, double processor_s) {
    for (size_t i = 0; i < ms_.size(); ++i) ms_[i].push_back(ms.at(i));
    seconds_ += ms.back() / 1e3;
    processor_s_ += processor_s;
  }

  size_t runs() const { return ms_[0].size(); }
  double seconds() const { return seconds_; }
  double percentile_ms(size_t stage, double percent) const {
    std::vector<double> sorted = ms_[stage];
    if (sorted.empty()) return 0;
    std::sort(sorted.begin(), sorted.end());
    const double at = percent / 100 * double(sorted.size() - 1);
    const size_t low = size_t(at);
    const size_t high = std::min(low + 1, sorted.size() - 1);
    return sorted[low] + (sorted[high] - sorted[low]) * (at - double(low));
  }
  double median_ms() const { return percentile_ms(kStages.size() - 1, 50); }
  double runs_per_second() const { return 1e3 / std::max(1e-6, median_ms()); }
  double processor_ms() const { return 1e3 * processor_s_ / double(std::max<size_t>(1, runs())); }
  double cores_busy() const { return processor_s_ / std::max(1e-6, seconds_); }

  // Empty if the times are reliable.
  std::vector<std::string> warnings(int min_runs, double min_seconds) const {
    std::vector<std::string> reasons;
    char text[128];
    if (runs() < size_t(min_runs) || seconds_ < min_seconds) {
      std::snprintf(text, sizeof text, "%zu runs in %.1f s, %d and %.1f s asked for", runs(), seconds_, min_runs,
                    min_seconds);
      reasons.emplace_back(text);
    }
    const double spread = percentile_ms(kStages.size() - 1, 90) / std::max(1e-6, median_ms());
    if (spread > kMaxSpread) {
      std::snprintf(text, sizeof text, "p90 is %.2f times p50, %.2f allowed", spread, kMaxSpread);
      reasons.emplace_back(text);
    }
    return reasons;
  }
  Json ms_json() const {
    Json ms;
    for (size_t i = 0; i < kStages.size(); ++i) {
      for (const int percent : {50, 90, 99}) {
        ms[kStages[i]]["p" + std::to_string(percent)] = rounded_ms(percentile_ms(i, percent));
      }
    }
    return ms;
  }

 private:
  std::vector<std::vector<double>> ms_ = std::vector<std::vector<double>>(kStages.size());
  double seconds_ = 0, processor_s_ = 0;
};

double ms_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

// One source with the times of its frames.
class Case {
 public:
  Case(const maquette::Context& context, std::string uri) : context_(context), uri_(std::move(uri)) { open(); }

  const std::string& uri() const { return uri_; }
  const StageTimes& times() const { return times_; }

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

    times_.add({ms_between(start, taken), stats.preprocess_ms, stats.trunk_ms, stats.proposals_ms, stats.box_head_ms,
                stats.dense_head_ms, stats.crops_ms, stats.decode_ms, total_ms},
               own_processor_seconds() - cpu_before_s);
    people_ += stats.person_count;
    return total_ms;
  }

  // Frames of a live source that pass between two blocks are not dropped ones.
  void pause() { last_sequence_.reset(); }

  const maq_densepose_stats& latest() const { return stats_; }
  double people() const { return double(people_) / double(std::max<size_t>(1, times_.runs())); }

  Json json(const Options& options) const {
    const std::vector<std::string> reasons = times_.warnings(options.runs, options.seconds);
    return {{"source", uri_},
            {"size_px", size_px_},
            {"network_px", {stats_.network_width_px, stats_.network_height_px}},
            {"provider", name_of(stats_.provider)},
            {"threads", stats_.threads},
            {"threads_measured", stats_.is_threads_measured != 0},
            {"runs", times_.runs()},
            {"seconds", times_.seconds()},
            {"people", people()},
            {"proposals", stats_.proposal_count},
            {"dropped_frames", dropped_frames_},
            {"ms", times_.ms_json()},
            {"fps", times_.runs_per_second()},
            {"cpu_ms", times_.processor_ms()},
            {"cores_busy", times_.cores_busy()},
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
  StageTimes times_;
  maq_densepose_stats stats_{};
  std::array<int32_t, 2> size_px_{};
  std::optional<uint64_t> last_sequence_;
  int64_t people_ = 0;
  uint64_t dropped_frames_ = 0;
};

void print_table(const std::vector<std::unique_ptr<Case>>& cases) {
  size_t widest = 6;
  for (const auto& timed : cases) widest = std::max(widest, timed->uri().size());
  print_output("%-*s  people    FPS    p50    p90    p99 ms   CPU ms |", int(widest), "source");
  const size_t whole = kStages.size() - 1;
  for (size_t i = 0; i < whole; ++i) print_output(" %s", kStages[i]);
  print_output("\n");
  for (const auto& timed : cases) {
    const StageTimes& times = timed->times();
    print_output("%-*s  %6.2f %6.1f %6.1f %6.1f %6.1f %11.1f |", int(widest), timed->uri().c_str(), timed->people(),
                 times.runs_per_second(), times.median_ms(), times.percentile_ms(whole, 90),
                 times.percentile_ms(whole, 99), times.processor_ms());
    for (size_t i = 0; i < whole; ++i) {
      print_output(" %*.1f", int(std::char_traits<char>::length(kStages[i])), times.percentile_ms(i, 50));
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
    return timed.times().runs() < size_t(options.runs) || timed.times().seconds() < options.seconds;
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
  const double measured_s = std::max(1e-3, ms_between(measured_from, Clock::now()) / 1e3);
  const double others = std::max(0.0, others_processor_seconds() - others_before_s) /
                        (measured_s * std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::string> reasons;
  if (others > kMaxOthers) {
    char text[64];
    std::snprintf(text, sizeof text, "other processes used %.0f %% of the CPU", 100 * others);
    reasons.emplace_back(text);
  }
  Json document;
  document["schema"] = kSchema;
  document["machine"] = describe_machine();
  document["build"] = describe_build(context);
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
    for (const std::string& reason : timed->times().warnings(options.runs, options.seconds)) {
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
  std::vector<std::string> sources;
  app.add_option("source", sources,
                 "Images, clips or URIs, measured alternately; default: one, four and no people of stub:people");
  app.add_option("--json", options.json,
                 "Also write everything to this file (docs/reference/formats.md, \"Benchmarks\")");
  add_model_options(app, options.model);
  app.add_option("--warm-up", options.warm_up, "Frames of each source that are not counted (default 10)")
      ->check(CLI::Range(0, 100000));
  app.add_option("--runs", options.runs, "Minimum number of frames of each source (default 100)")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--seconds", options.seconds, "Minimum time of each source in seconds (default 3)")
      ->check(CLI::Range(0.0, 86400.0));
  app.footer(
      "The time of a frame begins when the source is asked for it and ends with the result. CPU ms is the CPU time of\n"
      "all threads for one frame; it is a measure of energy on every machine. Compare times of one run only. A "
      "warning\n"
      "says why times are unreliable: other processes, few runs, wide spread.\n\n"
      "Examples:\n"
      "  maquette bench\n"
      "  maquette bench 'stub:people?count=2&size=1280x720' clip.mp4 --threads 1 --json bench.json");
  int exit_code = 0;
  app.callback([&] {
    if (!sources.empty()) options.sources = sources;
    exit_code = run_bench(options);
  });
  return run_program(app, argc, argv, &exit_code);
} catch (const std::exception& error) {  // no memory for the options
  return report(error);
}
