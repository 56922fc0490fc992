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
// A block of a case runs over the same stretch of frames as the others. The first frames are not measured, as networks
// see several frames; then up to kMeasuredInBlock are, within kBlockMs.
constexpr size_t kShownFirst = 6, kMeasuredInBlock = 10;
constexpr double kBlockMs = 300;
constexpr int32_t kNetworkSidePx = 64;   // of the networks' input
constexpr uint32_t kFramesSampled = 11;  // as in the benchmarks
constexpr double kMaxStepS = 0.125;      // of maq_predictor_sample

using Clock = std::chrono::steady_clock;
using OrderedJson = nlohmann::ordered_json;

// Consecutive frames of a source in memory, and the same at the size of the networks.
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

// One measured case: its work for a frame, and the times of its stages.
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

  // Runs one stretch from its beginning. Counts the runs only with `counts`.
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
  void count_resting() { ++resting_; }  // a frame for which no network ran

 private:
  virtual void reset() = 0;
  virtual void show(const maquette::Frame& frame) = 0;
  virtual std::vector<double> run(const maquette::Frame& frame, double step_s) = 0;  // milliseconds by stage

  const char* name_;
  StageTimes times_;
  int resting_ = 0;
};

class NoveltyCase final : public PredictionCase {
 public:
  NoveltyCase(const char* name, const maquette::Context& context, const maq_novelty_config& config)
      : PredictionCase(name, {"resize", "encoder", "nearest", "likelihood", "map", "frame"}),
        novelty_(context, config) {}

  void add_settings(OrderedJson* json) const override { (*json)["threads"] = novelty_.stats().threads; }
  const maquette::Novelty& novelty() const { return novelty_; }

 private:
  void reset() override { novelty_.reset(); }
  void show(const maquette::Frame& frame) override { novelty_.push(frame); }
  std::vector<double> run(const maquette::Frame& frame, double) override {
    novelty_.push(frame);
    const auto pushed = Clock::now();
    novelty_.map();
    const double map_ms = ms_between(pushed, Clock::now());
    const maq_novelty_stats stats = novelty_.stats();
    return {stats.resize_ms, stats.network_ms, stats.nearest_ms, stats.transformer_ms, map_ms};
  }

  maquette::Novelty novelty_;
};

// Pushes a frame and predicts the next one, without sampling.
class FrameCase final : public PredictionCase {
 public:
  FrameCase(const char* name, const maquette::Context& context, const maq_predictor_config& config)
      : PredictionCase(name, stages_of(config)),
        predictor_(context, config),
        has_network_(config.method == MAQ_PREDICTOR_REFINED) {}

  void add_settings(OrderedJson*) const override {}

 private:
  static std::vector<const char*> stages_of(const maq_predictor_config& config) {
    std::vector<const char*> stages{"luma", "flow", "weights", "project", "warp"};
    if (config.method == MAQ_PREDICTOR_REFINED) stages.push_back("network");
    stages.push_back("frame");
    return stages;
  }
  void reset() override { predictor_.reset(); }
  void show(const maquette::Frame& frame) override { predictor_.push(frame); }
  std::vector<double> run(const maquette::Frame& frame, double step_s) override {
    predictor_.push(frame);
    predictor_.predict(step_s);
    const maq_predictor_stats stats = predictor_.stats();
    std::vector<double> ms{stats.luma_ms, stats.flow_ms, stats.weights_ms, stats.project_ms, stats.warp_ms};
    if (has_network_) ms.push_back(stats.networks_ms);
    if (has_network_ && stats.networks_ms == 0) count_resting();
    return ms;
  }

  maquette::Predictor predictor_;
  const bool has_network_;
};

// Pushes a frame, samples futures, and decodes the last frame of one.
class SampledCase final : public PredictionCase {
 public:
  SampledCase(const char* name, const maquette::Context& context, const maq_predictor_config& config, uint32_t samples,
              uint32_t frames)
      : PredictionCase(name, {"push", "sample", "decode", "frame"}),
        predictor_(context, config),
        samples_(samples),
        frames_(frames) {}

  bool sees_small_frames() const override { return true; }
  void add_settings(OrderedJson* json) const override {
    (*json)["samples"] = samples_;
    (*json)["sampled_frames"] = frames_;
  }
  const maquette::Predictor& predictor() const { return predictor_; }

 private:
  void reset() override { predictor_.reset(); }
  void show(const maquette::Frame& frame) override { predictor_.push(frame); }
  std::vector<double> run(const maquette::Frame& frame, double step_s) override {
    const auto begin = Clock::now();
    predictor_.push(frame);
    const auto pushed = Clock::now();
    predictor_.sample(samples_, frames_, step_s);
    const auto sampled = Clock::now();
    if (predictor_.stats().sampled_frame_count == 0) count_resting();
    predictor_.acquire_sample(samples_ - 1, frames_);
    return {ms_between(begin, pushed), ms_between(pushed, sampled), ms_between(sampled, Clock::now())};
  }

  maquette::Predictor predictor_;
  const uint32_t samples_, frames_;
};

using Cases = std::vector<std::unique_ptr<PredictionCase>>;

// Both share their networks.
void add_novelty_cases(const maquette::Context& context, const PredictionBenchOptions& options,
                       const std::string& bundle, Cases* cases) {
  maq_novelty_config config = maquette::default_novelty_config();
  if (!bundle.empty()) config.model.bundle_path = bundle.c_str();
  config.model.threads = options.threads;
  auto transformer = std::make_unique<NoveltyCase>("novelty", context, config);
  config.shared_with = transformer->novelty().get();
  config.method = MAQ_NOVELTY_BIGRAM;
  auto bigram = std::make_unique<NoveltyCase>("novelty by bigrams", context, config);
  cases->push_back(std::move(transformer));
  cases->push_back(std::move(bigram));
}

// All share their networks.
void add_sampled_cases(const maquette::Context& context, maq_predictor_config config, Cases* cases) {
  config.method = MAQ_PREDICTOR_SAMPLED;
  config.temperature = 1;
  struct Sampling {
    const char* name;
    uint32_t samples, frames;
  };
  const Sampling samplings[] = {{"next, sampled", 1, 1},
                                {"11 sampled, 1 sample", 1, kFramesSampled},
                                {"11 sampled, 4 samples", 4, kFramesSampled}};
  for (const Sampling& sampling : samplings) {
    auto sampled = std::make_unique<SampledCase>(sampling.name, context, config, sampling.samples, sampling.frames);
    if (config.shared_with == nullptr) config.shared_with = sampled->predictor().get();
    cases->push_back(std::move(sampled));
  }
}

// Adds the reason to `left_out` if the bundle has no network for `add`.
template <class Add>
void add_if_supported(const Add& add, const char* reason, std::vector<std::string>* left_out) {
  try {
    add();
  } catch (const maquette::Error& error) {
    if (error.status() != MAQ_ERROR_UNSUPPORTED) throw;
    left_out->push_back(std::string(reason) + ": " + error.what());
  }
}

Cases make_cases(const maquette::Context& context, const PredictionBenchOptions& options, const std::string& bundle,
                 std::vector<std::string>* left_out) {
  Cases cases;
  add_novelty_cases(context, options, bundle, &cases);
  maq_predictor_config predictor = maquette::default_predictor_config();
  predictor.model.threads = options.threads;
  if (!bundle.empty()) predictor.model.bundle_path = bundle.c_str();
  const auto add_frame_case = [&](const char* name, maq_predictor_method method) {
    predictor.method = method;
    cases.push_back(std::make_unique<FrameCase>(name, context, predictor));
  };
  add_frame_case("next, motion", MAQ_PREDICTOR_MOTION);
  add_frame_case("next, auto", MAQ_PREDICTOR_AUTO);
  add_if_supported([&] { add_frame_case("next, refined", MAQ_PREDICTOR_REFINED); }, "No frame is refined", left_out);
  add_if_supported([&] { add_sampled_cases(context, predictor, &cases); }, "No frame is sampled", left_out);
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

// Returns the time of four samples divided by the time of one; nothing if they were not measured.
std::optional<double> four_samples_times(const Cases& cases) {
  const auto named = [&](const std::string& name) {
    return std::find_if(cases.begin(), cases.end(), [&](const auto& timed) { return timed->name() == name; });
  };
  const auto one = named("11 sampled, 1 sample"), four = named("11 sampled, 4 samples");
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

void measure(const Cases& cases, const Stretch& stretch, const PredictionBenchOptions& options) {
  const auto is_unfinished = [&](const PredictionCase& timed) {
    return timed.times().runs() < size_t(options.runs) || timed.times().seconds() < options.seconds;
  };
  ProgressBar progress("measuring", int64_t(cases.size()) * options.runs);
  int64_t done = 0;
  for (bool any = true; any && !interrupted();) {
    any = false;
    for (const auto& timed : cases) {
      if (!is_unfinished(*timed) || interrupted()) continue;
      any = true;
      const size_t before = timed->times().runs();
      timed->run_block(stretch, true);
      done += int64_t(timed->times().runs() - before);
      progress.advance(done, timed->name());
    }
  }
  progress.finish();
}

// The results of all cases, and their circumstances.
struct Measured {
  const maquette::Context& context;
  const Stretch& stretch;
  const Cases& cases;
  std::string bundle;
  std::vector<std::string> left_out;
  double create_ms = 0, other_processes_cpu_fraction = 0;
};

OrderedJson document_of(const Measured& measured, const PredictionBenchOptions& options) {
  const std::vector<std::string> reasons = OtherProcesses::warnings(measured.other_processes_cpu_fraction);
  OrderedJson document;
  document["schema"] = kPredictionSchema;
  document["machine"] = describe_machine();
  document["build"] = describe_build(measured.context);
  document["bundle"] = measured.bundle;
  document["settings"] = {{"source", options.source},   {"step_s", measured.stretch.step_s},
                          {"threads", options.threads}, {"warm_up", options.warm_up},
                          {"runs", options.runs},       {"seconds", options.seconds}};
  document["create_ms"] = measured.create_ms;
  document["peak_memory_mib"] = double(peak_memory_bytes()) / kMibibytes;
  document["other_processes_cpu_fraction"] = measured.other_processes_cpu_fraction;
  document["valid"] = reasons.empty();
  document["warnings"] = reasons;
  document["left_out"] = measured.left_out;
  document["cases"] = OrderedJson::array();
  for (const auto& timed : measured.cases) document["cases"].push_back(json_of(*timed, measured.stretch, options));
  const std::optional<double> four_times = four_samples_times(measured.cases);
  if (four_times) document["four_samples_times"] = *four_times;
  return document;
}

void print_measured(const Measured& measured, const PredictionBenchOptions& options) {
  const maq_frame_desc desc = measured.stretch.frames.front().desc();
  print_output("%s, %d x %d; samples at %d x %d\n", options.source.c_str(), desc.width_px, desc.height_px,
               kNetworkSidePx, kNetworkSidePx);
  print_cases(measured.cases);
  const std::optional<double> four_times = four_samples_times(measured.cases);
  if (four_times) print_output("4 samples take %.2f times as long as 1\n", *four_times);
  print_output("create %.0f ms, peak memory %.0f MiB\n", measured.create_ms, double(peak_memory_bytes()) / kMibibytes);
  for (const std::string& sentence : measured.left_out) print_output("%s\n", sentence.c_str());
  for (const std::string& reason : OtherProcesses::warnings(measured.other_processes_cpu_fraction)) {
    print_output("Warning: %s\n", reason.c_str());
  }
  for (const auto& timed : measured.cases) {
    for (const std::string& reason : timed->warnings(options)) {
      print_output("Warning: %s: %s\n", timed->name(), reason.c_str());
    }
  }
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
  Measured measured{context, stretch, cases, bundle, left_out};
  measured.create_ms = ms_between(begin, Clock::now());
  for (const auto& timed : cases) {
    for (int shown = 0; shown < options.warm_up && !interrupted(); shown += int(kMeasuredInBlock)) {
      timed->run_block(stretch, false);
    }
  }
  const OtherProcesses other_processes;
  measure(cases, stretch, options);
  measured.other_processes_cpu_fraction = other_processes.cpu_fraction();
  const OrderedJson document = document_of(measured, options);
  print_measured(measured, options);
  if (!options.json.empty()) {
    write_json_file(options.json, document, 1);
    print_output("Written: %s\n", options.json.c_str());
  }
  return interrupted() ? 1 : 0;
}
