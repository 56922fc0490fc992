#include "bench/prediction_bench.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "arguments/bundle_argument.h"
#include "arguments/source_argument.h"
#include "bench/stage_times.h"
#include "interrupt.h"
#include "machine.h"
#include "output/output_file.h"
#include "output/progress_bar.h"
#include "print.h"

namespace {

constexpr const char* kPredictionSchema = "maquette-bench-prediction-1";
constexpr double kMibibytes = 1024.0 * 1024.0;
// A block of a case goes through one stretch of the stream, the same for all: frames that are shown first, for a
// network sees several, then those that are measured, or as many as fit into so much time.
constexpr size_t kShownFirst = 6, kMeasuredInBlock = 10;
constexpr double kBlockMs = 300;
constexpr int32_t kNetworkSidePx = 64;  // of the square that networks see
constexpr uint32_t kFramesDrawn = 11;   // as benchmarks/sampling
constexpr double kMaxStepS = 0.125;     // of maq_predictor_draw

using Clock = std::chrono::steady_clock;
using OrderedJson = nlohmann::ordered_json;

// Consecutive frames of a source, and the same at the size of the networks, in memory.
struct Stretch {
  std::vector<maquette::Frame> frames, small_frames;
  double step_s = 0;
};

Stretch read_stretch(const maquette::Context& context, const std::string& text) {
  maq_source_config config = maquette::default_source_config();
  config.frame_pool_size = kShownFirst + kMeasuredInBlock + 2;
  const SourceArgument argument = parse_source_argument(text);
  maquette::Source source(context, argument.uri, &config);
  const StoppedByInterrupt stopped(source);
  Stretch stretch;
  while (stretch.frames.size() < kShownFirst + kMeasuredInBlock) {
    std::optional<maquette::Frame> frame = source.next();
    if (!frame && interrupted()) break;
    if (!frame) {
      throw std::runtime_error(argument.stem + " has " + std::to_string(stretch.frames.size()) + " of the " +
                               std::to_string(kShownFirst + kMeasuredInBlock) +
                               " frames that are measured; give a camera or a longer clip.");
    }
    stretch.small_frames.push_back(frame->resized(kNetworkSidePx, kNetworkSidePx));
    stretch.frames.push_back(std::move(*frame));
  }
  if (stretch.frames.size() > 1) {
    const int64_t passed_ns = stretch.frames.back().desc().timestamp_ns - stretch.frames.front().desc().timestamp_ns;
    stretch.step_s = std::clamp(double(passed_ns) / 1e9 / double(stretch.frames.size() - 1), 1e-3, kMaxStepS);
  }
  return stretch;
}

// What is measured: what it does with a frame, and how long the stages of that took.
class PredictionCase {
 public:
  PredictionCase(const char* name, std::vector<const char*> stages) : name_(name), times_(std::move(stages)) {}
  virtual ~PredictionCase() = default;

  const char* name() const { return name_; }
  const StageTimes& times() const { return times_; }
  virtual bool sees_small_frames() const { return false; }
  std::vector<std::string> warnings(const PredictionBenchOptions& options) const {
    std::vector<std::string> reasons = times_.warnings(options.runs, options.seconds);
    if (resting_ > 0) {
      reasons.push_back("nothing moved in " + std::to_string(resting_) + " frames, so that no network ran");
    }
    return reasons;
  }
  virtual void add_settings(OrderedJson* json) const = 0;

  // One stretch from its beginning; counts no run where `counts` says so.
  void run_block(const Stretch& stretch, bool counts) {
    const auto& frames = sees_small_frames() ? stretch.small_frames : stretch.frames;
    reset();
    for (size_t i = 0; i < kShownFirst && !interrupted(); ++i) show(frames[i]);
    const auto from = Clock::now();
    for (size_t i = kShownFirst; i < frames.size() && !interrupted(); ++i) {
      const double processor_before_s = own_processor_seconds();
      const auto begin = Clock::now();
      std::vector<double> ms = run(frames[i], stretch.step_s);
      ms.push_back(ms_between(begin, Clock::now()));
      if (counts) times_.add(ms, own_processor_seconds() - processor_before_s);
      if (ms_between(from, Clock::now()) > kBlockMs) break;
    }
  }

 protected:
  void count_resting() { ++resting_; }  // a frame of which a network ought to make something, and did not

 private:
  virtual void reset() = 0;
  virtual void show(const maquette::Frame& frame) = 0;
  virtual std::vector<double> run(const maquette::Frame& frame, double step_s) = 0;  // milliseconds by stage

  const char* name_;
  StageTimes times_;
  int resting_ = 0;
};

class SurpriseCase final : public PredictionCase {
 public:
  SurpriseCase(const char* name, const maquette::Context& context, const maq_surprise_config& config)
      : PredictionCase(name, {"resize", "encoder", "nearest", "likelihood", "map", "frame"}),
        surprise_(context, config) {}

  void add_settings(OrderedJson* json) const override { (*json)["threads"] = surprise_.stats().threads; }
  const maquette::Surprise& surprise() const { return surprise_; }

 private:
  void reset() override { surprise_.reset(); }
  void show(const maquette::Frame& frame) override { surprise_.push(frame); }
  std::vector<double> run(const maquette::Frame& frame, double) override {
    surprise_.push(frame);
    const auto pushed = Clock::now();
    surprise_.map();
    const double map_ms = ms_between(pushed, Clock::now());
    const maq_surprise_stats stats = surprise_.stats();
    return {stats.resize_ms, stats.network_ms, stats.nearest_ms, stats.transformer_ms, map_ms};
  }

  maquette::Surprise surprise_;
};

// A frame is pushed, and the next one made of it, without drawing.
class PictureCase final : public PredictionCase {
 public:
  PictureCase(const char* name, const maquette::Context& context, const maq_predictor_config& config)
      : PredictionCase(name, stages_of(config)),
        predictor_(context, config),
        has_network_(config.method == MAQ_PREDICTION_NETWORK) {}

  void add_settings(OrderedJson*) const override {}

 private:
  static std::vector<const char*> stages_of(const maq_predictor_config& config) {
    std::vector<const char*> stages{"brightness", "motion", "choice", "move_on", "pixels"};
    if (config.method == MAQ_PREDICTION_NETWORK) stages.push_back("network");
    stages.push_back("frame");
    return stages;
  }
  void reset() override { predictor_.reset(); }
  void show(const maquette::Frame& frame) override { predictor_.push(frame); }
  std::vector<double> run(const maquette::Frame& frame, double step_s) override {
    predictor_.push(frame);
    predictor_.predict(step_s);
    const maq_predictor_stats stats = predictor_.stats();
    std::vector<double> ms{stats.grey_ms, stats.flow_ms, stats.choice_ms, stats.project_ms, stats.fetch_ms};
    if (has_network_) ms.push_back(stats.networks_ms);
    if (has_network_ && stats.networks_ms == 0) count_resting();
    return ms;
  }

  maquette::Predictor predictor_;
  const bool has_network_;
};

// A frame is pushed, samples of what comes are drawn by networks, and the last picture of one is made.
class DrawnCase final : public PredictionCase {
 public:
  DrawnCase(const char* name, const maquette::Context& context, const maq_predictor_config& config, uint32_t samples,
            uint32_t frames)
      : PredictionCase(name, {"push", "draw", "picture", "frame"}),
        predictor_(context, config),
        passes_(config.passes),
        samples_(samples),
        frames_(frames) {}

  bool sees_small_frames() const override { return true; }
  void add_settings(OrderedJson* json) const override {
    (*json)["samples"] = samples_;
    (*json)["frames_drawn"] = frames_;
    (*json)["passes"] = passes_;
  }
  const maquette::Predictor& predictor() const { return predictor_; }

 private:
  void reset() override { predictor_.reset(); }
  void show(const maquette::Frame& frame) override { predictor_.push(frame); }
  std::vector<double> run(const maquette::Frame& frame, double step_s) override {
    const auto begin = Clock::now();
    predictor_.push(frame);
    const auto pushed = Clock::now();
    predictor_.draw(samples_, frames_, step_s);
    const auto drawn = Clock::now();
    if (predictor_.stats().drawn_count == 0) count_resting();
    predictor_.drawn(samples_ - 1, frames_);
    return {ms_between(begin, pushed), ms_between(pushed, drawn), ms_between(drawn, Clock::now())};
  }

  maquette::Predictor predictor_;
  const uint32_t passes_, samples_, frames_;
};

using Cases = std::vector<std::unique_ptr<PredictionCase>>;

// Networks are shared: those of surprise by its two cases, those that draw by all of theirs. `left_out`: sentences on
// what the bundle does not have.
Cases make_cases(const maquette::Context& context, const PredictionBenchOptions& options, const std::string& bundle,
                 std::vector<std::string>* left_out) {
  Cases cases;
  maq_surprise_config surprise = maquette::default_surprise_config();
  if (!bundle.empty()) surprise.bundle_path = bundle.c_str();
  surprise.threads = options.threads;
  auto first = std::make_unique<SurpriseCase>("surprise", context, surprise);
  surprise.networks_of = first->surprise().get();
  surprise.method = MAQ_SURPRISE_TABLE;
  auto by_table = std::make_unique<SurpriseCase>("surprise by the table", context, surprise);
  cases.push_back(std::move(first));
  cases.push_back(std::move(by_table));

  maq_predictor_config predictor = maquette::default_predictor_config();
  predictor.threads = options.threads;
  predictor.method = MAQ_PREDICTION_MOTION;
  cases.push_back(std::make_unique<PictureCase>("next by motion", context, predictor));
  predictor.method = MAQ_PREDICTION_AUTO;
  cases.push_back(std::make_unique<PictureCase>("next by auto", context, predictor));

  if (!bundle.empty()) predictor.bundle_path = bundle.c_str();
  predictor.method = MAQ_PREDICTION_NETWORK;
  predictor.network_mode = MAQ_NETWORK_MENDED;
  try {
    cases.push_back(std::make_unique<PictureCase>("next by auto, mended", context, predictor));
  } catch (const maquette::Error& error) {
    if (error.status() != MAQ_ERROR_UNSUPPORTED) throw;
    left_out->push_back(std::string("Nothing is mended: ") + error.what());
  }
  predictor.network_mode = MAQ_NETWORK_DRAWN;
  predictor.temperature = 1;
  struct Drawing {
    const char* name;
    uint32_t passes, samples, frames;
  };
  const Drawing drawings[] = {{"next drawn, 1 pass", 1, 1, 1},
                              {"next drawn, 4 passes", 4, 1, 1},
                              {"next drawn, code after code", 0, 1, 1},
                              {"11 drawn, 1 sample", 0, 1, kFramesDrawn},
                              {"11 drawn, 4 samples", 0, 4, kFramesDrawn}};
  try {
    for (const Drawing& drawing : drawings) {
      predictor.passes = drawing.passes;
      auto drawn = std::make_unique<DrawnCase>(drawing.name, context, predictor, drawing.samples, drawing.frames);
      if (predictor.networks_of == nullptr) predictor.networks_of = drawn->predictor().get();
      cases.push_back(std::move(drawn));
    }
  } catch (const maquette::Error& error) {
    if (error.status() != MAQ_ERROR_UNSUPPORTED) throw;
    left_out->push_back(std::string("Frames are not drawn: ") + error.what());
  }
  return cases;
}

void print_cases(const Cases& cases) {
  print_output("%-28s %8s %9s %9s %9s %8s |\n", "", "a second", "p50", "p90", "p99 ms", "CPU ms");
  for (const auto& timed : cases) {
    const StageTimes& times = timed->times();
    const size_t whole = times.stages().size() - 1;
    print_output("%-28s %8.1f %9.2f %9.2f %9.2f %8.1f |", timed->name(), times.runs_per_second(), times.median_ms(),
                 times.percentile_ms(whole, 90), times.percentile_ms(whole, 99), times.processor_ms());
    for (size_t i = 0; i < whole; ++i) print_output(" %s %.2f", times.stages()[i], times.percentile_ms(i, 50));
    print_output("\n");
  }
}

// How many times as long four samples take as one; nothing where they were not measured.
std::optional<double> four_samples_times(const Cases& cases) {
  const auto named = [&](const std::string& name) {
    return std::find_if(cases.begin(), cases.end(), [&](const auto& timed) { return timed->name() == name; });
  };
  const auto one = named("11 drawn, 1 sample"), four = named("11 drawn, 4 samples");
  if (one == cases.end() || four == cases.end() || (*one)->times().runs() == 0) return std::nullopt;
  return (*four)->times().median_ms() / std::max(1e-6, (*one)->times().median_ms());
}

OrderedJson json_of(const PredictionCase& timed, const Stretch& stretch, const PredictionBenchOptions& options) {
  const StageTimes& times = timed.times();
  const maq_frame_desc desc = (timed.sees_small_frames() ? stretch.small_frames : stretch.frames).front().desc();
  const std::vector<std::string> reasons = timed.warnings(options);
  OrderedJson json = {{"name", timed.name()}, {"size_px", {desc.width_px, desc.height_px}}};
  timed.add_settings(&json);
  json["runs"] = times.runs();
  json["seconds"] = times.seconds();
  json["ms"] = times.ms_json();
  json["per_second"] = times.runs_per_second();
  json["cpu_ms"] = times.processor_ms();
  json["cores_busy"] = times.cores_busy();
  json["valid"] = reasons.empty();
  json["warnings"] = reasons;
  return json;
}

}  // namespace

int run_prediction_bench(const PredictionBenchOptions& options) {
  const std::string bundle = options.bundle.empty() ? default_prediction_bundle() : options.bundle;
  require_writable(options.json);
  catch_interrupts();
  const maquette::Context context;
  const Stretch stretch = read_stretch(context, options.source);
  if (interrupted()) return 1;
  std::vector<std::string> left_out;
  const auto begin = Clock::now();
  const Cases cases = make_cases(context, options, bundle, &left_out);
  const double create_ms = ms_between(begin, Clock::now());

  for (const auto& timed : cases) {
    for (int shown = 0; shown < options.warm_up && !interrupted(); shown += int(kMeasuredInBlock)) {
      timed->run_block(stretch, false);
    }
  }
  const OtherProcesses other_processes;
  const auto unfinished = [&](const PredictionCase& timed) {
    return timed.times().runs() < size_t(options.runs) || timed.times().seconds() < options.seconds;
  };
  ProgressBar progress("measuring", int64_t(cases.size()) * options.runs);
  int64_t done = 0;
  for (bool any = true; any && !interrupted();) {
    any = false;
    for (const auto& timed : cases) {
      if (!unfinished(*timed) || interrupted()) continue;
      any = true;
      const size_t before = timed->times().runs();
      timed->run_block(stretch, true);
      done += int64_t(timed->times().runs() - before);
      progress.advance(done, timed->name());
    }
  }
  progress.finish();

  const double others = other_processes.cpu_fraction();
  const std::vector<std::string> reasons = OtherProcesses::warnings(others);
  const std::optional<double> four_times = four_samples_times(cases);
  OrderedJson document;
  document["schema"] = kPredictionSchema;
  document["machine"] = describe_machine();
  document["build"] = describe_build(context);
  document["bundle"] = bundle;
  document["settings"] = {{"source", options.source},   {"step_s", stretch.step_s}, {"threads", options.threads},
                          {"warm_up", options.warm_up}, {"runs", options.runs},     {"seconds", options.seconds}};
  document["create_ms"] = create_ms;
  document["peak_memory_mib"] = double(peak_memory_bytes()) / kMibibytes;
  document["other_processes_cpu_fraction"] = others;
  document["valid"] = reasons.empty();
  document["warnings"] = reasons;
  document["left_out"] = left_out;
  document["cases"] = OrderedJson::array();
  for (const auto& timed : cases) document["cases"].push_back(json_of(*timed, stretch, options));
  if (four_times) document["four_samples_times"] = *four_times;

  const maq_frame_desc desc = stretch.frames.front().desc();
  print_output("%s, %d x %d; what is drawn at %d x %d\n", options.source.c_str(), desc.width_px, desc.height_px,
               kNetworkSidePx, kNetworkSidePx);
  print_cases(cases);
  if (four_times) print_output("4 samples take %.2f times as long as 1\n", *four_times);
  print_output("create %.0f ms, peak memory %.0f MiB\n", create_ms, double(peak_memory_bytes()) / kMibibytes);
  for (const std::string& sentence : left_out) print_output("%s\n", sentence.c_str());
  for (const std::string& reason : reasons) print_output("Warning: %s\n", reason.c_str());
  for (const auto& timed : cases) {
    for (const std::string& reason : timed->warnings(options)) {
      print_output("Warning: %s: %s\n", timed->name(), reason.c_str());
    }
  }
  if (!options.json.empty()) {
    write_json_file(options.json, document, 1);
    print_output("Written: %s\n", options.json.c_str());
  }
  return interrupted() ? 1 : 0;
}
