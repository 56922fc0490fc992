#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <map>
#include <maquette/maquette.hpp>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arguments/bundle_argument.h"
#include "arguments/source_argument.h"
#include "commands/commands.h"
#include "commands/prediction/predict_report.h"
#include "interrupt.h"
#include "output/frame_image.h"
#include "output/predicted_images.h"
#include "output/prediction_mark.h"
#include "output/progress_bar.h"
#include "output/sampled_frames.h"
#include "program.h"

namespace {

struct PredictOptions {
  std::string source;
  std::string bundle;
  int64_t from = -1;
  int64_t frames = 16;
  maq_predictor_method method = MAQ_PREDICTOR_AUTO;
  bool compare = false;
  bool json = false;
  int threads = 0;
  std::string out;
  SampleOptions sampling;

  bool needs_networks() const { return method == MAQ_PREDICTOR_SAMPLED || sampling.samples > 0; }
};

constexpr int64_t kDefaultFrom = 30;
constexpr double kShownBefore_s = 1;  // of seen frames at the beginning of a clip
constexpr double kDefaultStep_s = 0.1;

// Images side by side, each with its caption.
using CaptionedImages = std::vector<std::pair<std::string, Canvas>>;

// Returns the peak signal-to-noise ratio of 8-bit images; 99 dB for equal ones.
double psnr_db(const Canvas& one, const Canvas& other) {
  double squares = 0;
  for (size_t i = 0; i < one.bgr.size(); ++i) {
    const int difference = int(one.bgr[i]) - int(other.bgr[i]);
    squares += difference * difference;
  }
  squares /= double(one.bgr.size());
  return squares > 0 ? std::min(99.0, 10 * std::log10(255.0 * 255.0 / squares)) : 99;
}

std::string caption(const std::string& name, double ahead_s, std::optional<double> db) {
  char text[96];
  if (db) {
    std::snprintf(text, sizeof text, "%s +%.0f ms: %.1f dB", name.c_str(), 1e3 * ahead_s, *db);
  } else {
    std::snprintf(text, sizeof text, "%s +%.0f ms", name.c_str(), 1e3 * ahead_s);
  }
  return text;
}

// Scales the images down if the row would not fit into a frame.
Canvas side_by_side(const CaptionedImages& images) {
  const PictureSide size = PredictedImages::size_in_row(images.front().second.size(), images.size());
  Canvas row({size.width * int(images.size()), size.height});
  int x = 0;
  for (const auto& [name, image] : images) {
    Canvas named = image.resized(size);
    draw_caption(name, named);
    row.copy(named, x, 0);
    x += size.width;
  }
  return row;
}

maquette::Predictor make_predictor(const maquette::Context& context, const PredictOptions& options,
                                   maq_predictor_method method) {
  maq_predictor_config config = maquette::default_predictor_config();
  config.model.threads = options.threads;
  config.method = method;
  if (!options.bundle.empty()) config.model.bundle_path = options.bundle.c_str();
  options.sampling.apply(&config);
  return maquette::Predictor(context, config);
}

// Pushes the frames of a source up to one frame, then predicts the next ones.
class PredictionRun {
 public:
  explicit PredictionRun(const PredictOptions& options)
      : options_(options),
        argument_(parse_source_argument(options.source)),
        context_(open_context()),
        source_(context_, argument_.uri),
        stopped_(source_),
        info_(source_.info()),
        images_(context_, options.out, argument_.stem, info_.fps),
        predictor_(make_predictor(context_, options, options.method)) {
    if (options.compare) motion_.emplace(make_predictor(context_, options, MAQ_PREDICTOR_MOTION));
    if (options.sampling.samples > 0) samples_.emplace(context_, options.sampling, options.bundle, options.threads);
  }

  int run() {
    const int64_t from = last_seen_frame();
    ProgressBar progress(argument_.stem, from + 1 + options_.frames);
    watch(from, progress);
    if (interrupted()) return 1;
    const double step_s = frame_interval_s();
    if (samples_) samples_->sample(options_.frames, step_s);
    write_seen_frames();
    PredictionReport report;
    report.source = argument_.stem;
    report.last_seen_frame = last_.sequence;
    report.method = options_.method;
    report.has_errors = options_.compare;
    report.has_samples = samples_.has_value();
    has_truth_ = options_.compare;
    for (int64_t number = 1; number <= options_.frames && !interrupted(); ++number) {
      report.rows.push_back(predict_frame(number, step_s));
      progress.advance(seen_ + number, name_of(report.rows.back().method));
    }
    progress.finish();
    report.written = images_.finish();
    print_report(report, options_.json);
    return interrupted() ? 1 : 0;
  }

 private:
  int64_t last_seen_frame() const {
    if (options_.from >= 0) return options_.from;
    if (info_.frame_count <= 0) return kDefaultFrom;
    return std::clamp<int64_t>(info_.frame_count - 1 - options_.frames, 1, kDefaultFrom);
  }

  bool has_columns() const { return options_.compare || samples_.has_value(); }

  // Whether the chosen method has a column of its own beside last and motion.
  bool has_own_column() const {
    return options_.method != MAQ_PREDICTOR_LAST && options_.method != MAQ_PREDICTOR_MOTION;
  }

  void watch(int64_t from, ProgressBar& progress) {
    const size_t shown = images_.is_clip() ? size_t(std::max(1.0, kShownBefore_s * info_.fps)) : 1;
    while (seen_ <= from && !interrupted()) {
      const auto frame = source_.next();
      if (!frame) break;
      last_ = frame->desc();
      if (seen_ == 0) first_ = last_;
      predictor_.push(*frame);
      if (motion_) motion_->push(*frame);
      if (samples_) samples_->push(*frame);
      seen_images_.push_back(image_of(*frame));
      if (seen_images_.size() > shown) seen_images_.pop_front();
      progress.advance(++seen_, "seen");
    }
    if (interrupted() || seen_ > from) return;
    progress.finish();
    throw std::runtime_error(argument_.uri + " has " + std::to_string(seen_) + " frames, but --from is " +
                             std::to_string(from) + ": give a number below.");
  }

  double frame_interval_s() const {
    double step_s = info_.fps > 0 ? 1 / info_.fps : 0;
    if (step_s == 0 && seen_ > 1) {
      step_s = double(last_.timestamp_ns - first_.timestamp_ns) / 1e9 / double(seen_ - 1);
    }
    return step_s > 0 ? step_s : kDefaultStep_s;
  }

  // A clip begins with the frames that were seen last, as often side by side as the predicted rows have columns.
  void write_seen_frames() {
    if (!images_.is_clip()) return;
    const size_t compared = !options_.compare ? 0 : has_own_column() ? 4 : 3;
    const size_t columns = compared + (samples_ ? size_t(samples_->count()) + 1 : 0);
    for (const Canvas& image : seen_images_) {
      const CaptionedImages row(columns, {"seen", image});
      images_.add_to_clip(has_columns() ? side_by_side(row) : image);
    }
  }

  // Returns the frame that the source shows then, if there is one of the same size; sets the time ahead to its time.
  std::optional<Canvas> next_truth(PredictionRow& row) {
    if (!has_truth_) return std::nullopt;
    const std::optional<maquette::Frame> truth = source_.next();
    has_truth_ = truth && truth->desc().width_px == last_.width_px && truth->desc().height_px == last_.height_px;
    if (!has_truth_) return std::nullopt;
    row.ahead_s = double(truth->desc().timestamp_ns - last_.timestamp_ns) / 1e9;
    return image_of(*truth);
  }

  PredictionRow predict_frame(int64_t number, double step_s) {
    PredictionRow row;
    row.ahead_s = step_s * double(number);
    const std::optional<Canvas> truth = next_truth(row);
    const maquette::Frame frame = predictor_.predict(row.ahead_s);
    const maq_predictor_stats stats = predictor_.stats();
    row.method = stats.method;
    row.motion_fraction = double(stats.motion_fraction);
    row.predict_ms = double(stats.predict_ms);
    const Canvas image = image_of(frame);
    CaptionedImages columns;
    if (options_.compare) add_compared(image, truth, row, columns);
    if (samples_) add_samples(number, image, truth, row, columns);
    write(number, frame, image, columns);
    return row;
  }

  void add_compared(const Canvas& image, const std::optional<Canvas>& truth, PredictionRow& row,
                    CaptionedImages& columns) {
    const Canvas moved = image_of(motion_->predict(row.ahead_s)), &last = seen_images_.back();
    if (truth) {
      row.last_db = psnr_db(last, *truth);
      row.motion_db = psnr_db(moved, *truth);
      row.chosen_db = psnr_db(image, *truth);
    }
    columns = {{truth ? "truth" : "no truth", truth ? *truth : Canvas(image.size())},
               {caption("last", row.ahead_s, row.last_db), last},
               {caption("motion", row.ahead_s, row.motion_db), moved}};
    if (has_own_column()) {
      columns.emplace_back(caption(name_of(options_.method), row.ahead_s, row.chosen_db), image);
    }
  }

  void add_samples(int64_t number, const Canvas& image, const std::optional<Canvas>& truth, PredictionRow& row,
                   CaptionedImages& columns) {
    const std::vector<float> bits = samples_->entropy_map(number);
    for (const float own : bits) row.entropy_bits += double(own) / double(bits.size());
    for (int sample = 0; sample < samples_->count(); ++sample) {
      const maquette::Frame frame = samples_->frame(sample, number);
      Canvas shown = image_of(frame);
      std::optional<double> db;
      if (truth) db = row.samples_db.emplace_back(psnr_db(shown, *truth));
      if (!options_.compare && !options_.out.empty() && !images_.is_clip()) {
        images_.save(number, frame, nullptr, sample);
      }
      draw_prediction_mark(frame, shown);
      columns.emplace_back(caption("sample " + std::to_string(sample + 1), row.ahead_s, db), shown);
    }
    char text[64];
    std::snprintf(text, sizeof text, "entropy: %.2f bits", row.entropy_bits);
    columns.emplace_back(text, draw_entropy_map(bits, image));
  }

  void write(int64_t number, const maquette::Frame& frame, Canvas image, const CaptionedImages& columns) {
    if (options_.out.empty()) return;
    if (images_.is_clip()) {
      if (!has_columns()) draw_prediction_mark(frame, image);
      images_.add_to_clip(has_columns() ? side_by_side(columns) : image);
    } else if (options_.compare) {
      const Canvas row = side_by_side(columns);
      images_.save(number, frame, &row);
    } else if (!samples_) {  // samples were saved one by one
      images_.save(number, frame, nullptr);
    }
  }

  const PredictOptions& options_;
  const SourceArgument argument_;
  const maquette::Context context_;
  maquette::Source source_;
  const StoppedByInterrupt stopped_;
  const maq_source_info info_;
  PredictedImages images_;
  maquette::Predictor predictor_;
  std::optional<maquette::Predictor> motion_;  // with --compare
  std::optional<SampledFrames> samples_;       // with --samples
  std::deque<Canvas> seen_images_;             // the latest, for the clip
  maq_frame_desc first_{}, last_{};
  int64_t seen_ = 0;
  bool has_truth_ = false;
};

int predict(const PredictOptions& options) {
  if (options.out.empty() && !options.compare) {
    throw std::runtime_error("Nothing to do: name a clip or folder with --out, or print errors with --compare.");
  }
  catch_interrupts();
  return PredictionRun(options).run();
}

void add_frame_options(CLI::App& command, PredictOptions& options) {
  command.add_option("source", options.source, "Source of the frames; see `maquette sources`")->required();
  command
      .add_option("--from", options.from,
                  "Number of the last frame before the prediction, from 0; default: 30, or less in a "
                  "short clip")
      ->check(CLI::Range(int64_t(0), int64_t(1) << 40));
  command.add_option("-n,--frames", options.frames, "Predict N frames after --from; default: 16")
      ->check(CLI::Range(int64_t(1), int64_t(10000)));
  const std::map<std::string, maq_predictor_method> methods = {{"auto", MAQ_PREDICTOR_AUTO},
                                                               {"last", MAQ_PREDICTOR_LAST},
                                                               {"motion", MAQ_PREDICTOR_MOTION},
                                                               {"sampled", MAQ_PREDICTOR_SAMPLED}};
  command
      .add_option("-m,--method", options.method,
                  "last: the last frame. motion: every pixel continues its motion. auto (default): both, blended by "
                  "their past errors. sampled (research): one possible future")
      ->transform(CLI::CheckedTransformer(methods));
  command.add_flag("-c,--compare", options.compare,
                   "Print the errors (PSNR) by time ahead, and show truth and methods side by side");
}

void add_sample_options(CLI::App& command, SampleOptions& sampling) {
  command.add_option("--samples", sampling.samples, "Also show N possible futures (1 to 16) and their entropy map")
      ->check(CLI::Range(1, 16));
  command
      .add_option("--temperature", sampling.temperature,
                  "For sampling: 1 (default) samples by the probabilities, 0 takes the likeliest code")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--seed", sampling.seed, "For sampling: equal seeds give equal samples; default: 0");
}

// Throws for options of sampling without sampling.
void require_sampling(const CLI::App& command, const PredictOptions& options) {
  if (options.sampling.samples > 0 || options.method == MAQ_PREDICTOR_SAMPLED) return;
  for (const char* name : {"--temperature", "--seed"}) {
    if (command.count(name) > 0) throw CLI::RequiresError(name, "--samples or --method sampled");
  }
}

}  // namespace

void add_predict_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<PredictOptions>();
  CLI::App* command =
      app.add_subcommand("predict", "Predict the next frames of a clip or camera, and compare them with the real ones");
  add_frame_options(*command, *options);
  add_sample_options(*command, options->sampling);
  command->add_option("--bundle", options->bundle,
                      "Folder of the networks; default: MAQ_PREDICTION_BUNDLE, then the installed bundle");
  command->add_option("-t,--threads", options->threads, "Threads; default: the large cores, at most 4")
      ->check(CLI::Range(0, 64));
  command->add_option("-o,--out", options->out, "Clip (.mp4), or folder for PNG files");
  command->add_flag("--json", options->json, "Print one JSON document");
  command->footer(
      "A clip begins with the last second before the prediction. Predicted frames have a border with their time ahead; "
      "PNG\n"
      "files are also marked inside. PSNR is in dB: higher is better, and +1 dB is an error 11 % smaller.\n\n"
      "Examples:\n"
      "  maquette predict clip.mp4 --from 40 --frames 16 --compare --out next.mp4\n"
      "  maquette predict clip.mp4 --from 40 --compare            # print the errors only\n"
      "  maquette predict 'stub:people?count=2' --method motion --out next/\n"
      "  maquette predict clip.mp4 --samples 4 --temperature 0.7 --seed 3 --compare --out futures.mp4\n"
      "  maquette predict v4l2:/dev/video0 --from 60 --frames 10 --out next.mp4");
  command->callback([=] {
    require_sampling(*command, *options);
    if (options->needs_networks()) options->bundle = bundle_or_default(kPredictionNetworks, options->bundle);
    *exit_code = predict(*options);
  });
}
