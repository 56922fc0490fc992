#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <map>
#include <maquette/maquette.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments/bundle_argument.h"
#include "arguments/source_argument.h"
#include "commands/commands.h"
#include "commands/predict_surprise.h"
#include "interrupt.h"
#include "output/drawn_samples.h"
#include "output/frame_image.h"
#include "output/output_file.h"
#include "output/predicted_pictures.h"
#include "output/prediction_mark.h"
#include "output/progress_bar.h"
#include "print.h"
#include "program.h"

namespace {

struct PredictOptions {
  std::string source;
  int64_t from = -1;
  int64_t frames = 16;
  maq_prediction_method method = MAQ_PREDICTION_AUTO;
  bool compare = false;
  bool json = false;
  int threads = 0;
  std::string out;
  SampleOptions drawn;
};

constexpr int64_t kDefaultFrom = 30;
constexpr double kShownBefore_s = 1;  // of the frames that were seen, at the beginning of a clip

const char* name_of(maq_prediction_method method) {
  switch (method) {
    case MAQ_PREDICTION_LAST: return "last";
    case MAQ_PREDICTION_MOTION: return "motion";
    case MAQ_PREDICTION_NETWORK: return "network";
    default: return "auto";
  }
}

// Beside last and motion.
bool has_own_column(maq_prediction_method method) {
  return method == MAQ_PREDICTION_AUTO || method == MAQ_PREDICTION_NETWORK;
}

// Peak signal-to-noise ratio of pictures of 8 bits; 99 dB where they are the same.
double psnr_db(const cv::Mat& one, const cv::Mat& other) {
  const double squares = cv::norm(one, other, cv::NORM_L2SQR) / (3.0 * double(one.total()));
  return squares > 0 ? std::min(99.0, 10 * std::log10(255.0 * 255.0 / squares)) : 99;
}

// One picture ahead, by each method, and what was seen then.
struct Ahead {
  double ahead_s = 0;
  maq_prediction_method method = MAQ_PREDICTION_LAST;  // that made it; auto: both
  double motion_fraction = 0, predict_ms = 0;
  std::optional<double> last_db, motion_db, chosen_db;
  std::vector<double> samples_db;
  double uncertain_bits = 0;  // of a code of the samples
};

maquette::Predictor make_predictor(const maquette::Context& context, const PredictOptions& options,
                                   maq_prediction_method method) {
  maq_predictor_config config = maquette::default_predictor_config();
  config.threads = options.threads;
  config.method = method;
  config.network_mode = MAQ_NETWORK_MENDED;
  if (!options.drawn.bundle.empty()) config.bundle_path = options.drawn.bundle.c_str();
  return maquette::Predictor(context, config);
}

// Beside one another, each with its name, and smaller where the row would not fit into what is written.
cv::Mat side_by_side(const std::vector<std::pair<std::string, cv::Mat>>& pictures, const PredictedPictures& written) {
  const cv::Size size = written.size_in_row(pictures.front().second.size(), pictures.size());
  std::vector<cv::Mat> named(pictures.size());
  for (size_t i = 0; i < pictures.size(); ++i) {
    const auto& [name, picture] = pictures[i];
    if (picture.size() == size) {
      named[i] = picture.clone();
    } else {
      cv::resize(picture, named[i], size, 0, 0, cv::INTER_AREA);
    }
    draw_caption(name, named[i]);
  }
  cv::Mat row;
  cv::hconcat(named, row);
  return row;
}

std::string caption(const char* name, double ahead_s, std::optional<double> db) {
  char text[96];
  if (db) {
    std::snprintf(text, sizeof text, "%s +%.0f ms: %.1f dB", name, 1e3 * ahead_s, *db);
  } else {
    std::snprintf(text, sizeof text, "%s +%.0f ms", name, 1e3 * ahead_s);
  }
  return text;
}

std::string fraction_of_motion(const Ahead& ahead) {
  if (ahead.method != MAQ_PREDICTION_AUTO) return name_of(ahead.method);
  char text[32];
  std::snprintf(text, sizeof text, "%.0f %% motion", 100 * ahead.motion_fraction);
  return text;
}

void print_results(const PredictOptions& options, const std::string& stem, uint64_t last_seen,
                   const std::vector<Ahead>& found, const std::string& written) {
  if (options.json) {
    nlohmann::ordered_json document = {
        {"source", stem}, {"last_seen_frame", last_seen}, {"method", name_of(options.method)}};
    document["frames"] = nlohmann::ordered_json::array();
    for (const Ahead& ahead : found) {
      nlohmann::ordered_json frame = {{"ahead_s", ahead.ahead_s},
                                      {"method", name_of(ahead.method)},
                                      {"motion_fraction", std::round(1e3 * ahead.motion_fraction) / 1e3},
                                      {"predict_ms", rounded_ms(ahead.predict_ms)}};
      if (ahead.last_db) {
        frame["psnr_db"] = {{"last", *ahead.last_db}, {"motion", *ahead.motion_db}, {"chosen", *ahead.chosen_db}};
        if (options.drawn.samples > 0) frame["psnr_db"]["samples"] = ahead.samples_db;
      }
      if (options.drawn.samples > 0) frame["uncertainty_bits"] = ahead.uncertain_bits;
      document["frames"].push_back(frame);
    }
    if (!written.empty()) document["out"] = written;
    print_output("%s\n", json_text(document, 1).c_str());
    return;
  }
  if (options.compare) print_output("  ahead        last      motion    %s\n", name_of(options.method));
  for (const Ahead& ahead : found) {
    if (!options.compare) break;
    if (!ahead.last_db) {
      print_output("%6.0f ms   no frame to compare with\n", 1e3 * ahead.ahead_s);
      continue;
    }
    print_output("%6.0f ms  %7.2f dB  %7.2f dB  %7.2f dB  %s\n", 1e3 * ahead.ahead_s, *ahead.last_db, *ahead.motion_db,
                 *ahead.chosen_db, fraction_of_motion(ahead).c_str());
    if (!ahead.samples_db.empty()) {
      const auto [worst, best] = std::minmax_element(ahead.samples_db.begin(), ahead.samples_db.end());
      print_output("           samples %.2f to %.2f dB, %.2f bits a code\n", *worst, *best, ahead.uncertain_bits);
    }
  }
  if (!written.empty()) print_output("%s  %zu predicted frames -> %s\n", stem.c_str(), found.size(), written.c_str());
}

int predict(const PredictOptions& options) {
  if (options.out.empty() && !options.compare) {
    throw std::runtime_error(
        "Nothing is asked for: name a clip or folder with --out, or print figures with --compare.");
  }
  catch_interrupts();
  const SourceArgument argument = parse_source_argument(options.source);
  const maquette::Context context = open_context();
  maquette::Source source(context, argument.uri);
  const StoppedByInterrupt stopped(source);
  const maq_source_info info = source.info();
  int64_t from = options.from;
  if (from < 0) {
    from = kDefaultFrom;
    if (info.frame_count > 0) from = std::clamp<int64_t>(info.frame_count - 1 - options.frames, 1, kDefaultFrom);
  }
  PredictedPictures pictures(context, options.out, argument.stem, info.fps);
  maquette::Predictor predictor = make_predictor(context, options, options.method);
  std::optional<maquette::Predictor> motion;
  if (options.compare) motion = make_predictor(context, options, MAQ_PREDICTION_MOTION);
  std::optional<DrawnSamples> samples;
  if (options.drawn.samples > 0) samples.emplace(context, options.drawn, options.threads);

  ProgressBar progress(argument.stem, from + 1 + options.frames);
  std::deque<cv::Mat> before;  // the frames seen last, for the clip
  const size_t shown_before = pictures.is_clip() ? size_t(std::max(1.0, kShownBefore_s * info.fps)) : 1;
  maq_frame_desc first{}, last{};
  int64_t seen = 0;
  while (seen <= from && !interrupted()) {
    const auto frame = source.next();
    if (!frame) break;
    last = frame->desc();
    if (seen == 0) first = last;
    predictor.push(*frame);
    if (motion) motion->push(*frame);
    if (samples) samples->push(*frame);
    before.push_back(image_of(*frame));
    if (before.size() > shown_before) before.pop_front();
    progress.advance(++seen, "seen");
  }
  if (interrupted()) return 1;
  if (seen <= from) {
    progress.finish();
    throw std::runtime_error(argument.uri + " has " + std::to_string(seen) + " frames, but --from is " +
                             std::to_string(from) + ": give a number below.");
  }
  double step_s = info.fps > 0 ? 1 / info.fps : 0;
  if (step_s == 0 && seen > 1) step_s = double(last.timestamp_ns - first.timestamp_ns) / 1e9 / double(seen - 1);
  if (!(step_s > 0)) step_s = 0.1;

  if (samples) samples->draw(options.frames, step_s);
  const bool is_row = options.compare || samples.has_value();
  if (pictures.is_clip()) {
    const size_t compared = !options.compare ? 0 : has_own_column(options.method) ? 4 : 3;
    const size_t columns = compared + (samples ? size_t(samples->count()) + 1 : 0);
    for (const cv::Mat& picture : before) {
      const std::vector<std::pair<std::string, cv::Mat>> row(columns, {"seen", picture});
      pictures.add_to_clip(is_row ? side_by_side(row, pictures) : picture);
    }
  }
  std::vector<Ahead> found;
  bool has_truth = options.compare;
  for (int64_t i = 1; i <= options.frames && !interrupted(); ++i) {
    Ahead ahead;
    ahead.ahead_s = step_s * double(i);
    std::optional<maquette::Frame> truth;
    if (has_truth) truth = source.next();
    has_truth =
        truth.has_value() && truth->desc().width_px == last.width_px && truth->desc().height_px == last.height_px;
    if (has_truth) ahead.ahead_s = double(truth->desc().timestamp_ns - last.timestamp_ns) / 1e9;
    const maquette::Frame frame = predictor.predict(ahead.ahead_s);
    const maq_predictor_stats stats = predictor.stats();
    ahead.method = stats.method;
    ahead.motion_fraction = double(stats.motion_fraction);
    ahead.predict_ms = double(stats.predict_ms);
    cv::Mat picture = image_of(frame);
    std::vector<std::pair<std::string, cv::Mat>> columns;
    if (options.compare) {
      const cv::Mat moved = image_of(motion->predict(ahead.ahead_s));
      const cv::Mat seen_then = has_truth ? image_of(*truth) : cv::Mat(picture.size(), picture.type(), cv::Scalar());
      if (has_truth) {
        ahead.last_db = psnr_db(before.back(), seen_then);
        ahead.motion_db = psnr_db(moved, seen_then);
        ahead.chosen_db = psnr_db(picture, seen_then);
      }
      columns = {{has_truth ? "truth" : "no truth", seen_then},
                 {caption("last", ahead.ahead_s, ahead.last_db), before.back()},
                 {caption("motion", ahead.ahead_s, ahead.motion_db), moved}};
      if (has_own_column(options.method)) {
        columns.emplace_back(caption(name_of(options.method), ahead.ahead_s, ahead.chosen_db), picture);
      }
    }
    if (samples) {
      const std::vector<float> bits = samples->uncertainty(i);
      for (const float own : bits) ahead.uncertain_bits += double(own) / double(bits.size());
      for (int sample = 0; sample < samples->count(); ++sample) {
        const maquette::Frame drawn = samples->frame(sample, i);
        cv::Mat shown = image_of(drawn);
        std::optional<double> db;
        if (has_truth) db = ahead.samples_db.emplace_back(psnr_db(shown, columns.front().second));
        if (!options.compare && !options.out.empty() && !pictures.is_clip()) pictures.save(i, drawn, nullptr, sample);
        draw_prediction_mark(drawn, shown);
        columns.emplace_back(caption(("sample " + std::to_string(sample + 1)).c_str(), ahead.ahead_s, db), shown);
      }
      char text[64];
      std::snprintf(text, sizeof text, "uncertain: %.2f bits", ahead.uncertain_bits);
      columns.emplace_back(text, draw_uncertainty(bits, picture));
    }
    if (is_row && (options.compare || pictures.is_clip())) {
      const cv::Mat row = side_by_side(columns, pictures);
      if (pictures.is_clip()) {
        pictures.add_to_clip(row);
      } else if (!options.out.empty()) {
        pictures.save(i, frame, &row);
      }
    } else if (is_row) {
      // Each was saved.
    } else if (pictures.is_clip()) {
      draw_prediction_mark(frame, picture);
      pictures.add_to_clip(picture);
    } else {
      pictures.save(i, frame, nullptr);
    }
    found.push_back(ahead);
    progress.advance(seen + i, name_of(ahead.method));
  }
  progress.finish();
  print_results(options, argument.stem, last.sequence, found, pictures.finish());
  return interrupted() ? 1 : 0;
}

}  // namespace

void add_predict_command(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<PredictOptions>();
  CLI::App* command = app.add_subcommand(
      "predict", "Show what a clip or a camera will show next, beside what it did show, or what of it is surprising");
  auto surprise = std::make_shared<SurpriseOptions>();
  auto is_surprise = std::make_shared<bool>(false);
  command->add_option("source", options->source, "Source of the frames; see `maquette sources`")->required();
  CLI::Option* const flag = command->add_flag(
      "-s,--surprise", *is_surprise,
      "Predict no pictures, but say how surprising each frame is after those before: a meter in a terminal, and a line "
      "for each event; with --json a line a frame");
  command
      ->add_option("--events", surprise->event_ratio,
                   "An event is that many times as surprising as the 8 frames before, or as little; default: 4")
      ->check(CLI::Range(1.001, 1e6))
      ->needs(flag);
  command->add_option("--max-frames", surprise->max_frames, "Stop after so many; default: at the end, or at Ctrl-C")
      ->check(CLI::Range(int64_t(1), int64_t(1) << 40))
      ->needs(flag);
  command->add_option(
      "--bundle", surprise->bundle,
      "Folder of the networks of surprise, samples and --method network; default: MAQ_PREDICTION_BUNDLE, then the one "
      "installed with this program");
  const auto for_pictures = [flag](CLI::Option* option) { option->excludes(flag); };
  for_pictures(command
                   ->add_option("--from", options->from,
                                "Number of the last frame that is seen, from 0; default: 30, or less of a short clip")
                   ->check(CLI::Range(int64_t(0), int64_t(1) << 40)));
  for_pictures(command->add_option("-n,--frames", options->frames, "Predict so many frames after it; default: 16")
                   ->check(CLI::Range(int64_t(1), int64_t(10000))));
  for_pictures(
      command
          ->add_option("-m,--method", options->method,
                       "last: the last frame; motion: everything moves on as it did; auto (default): both mixed, place "
                       "by place, by how right they were so far; network: that, mended by a network, which is nearer "
                       "to the truth far ahead")
          ->transform(CLI::CheckedTransformer(
              std::map<std::string, maq_prediction_method>{{"auto", MAQ_PREDICTION_AUTO},
                                                           {"last", MAQ_PREDICTION_LAST},
                                                           {"motion", MAQ_PREDICTION_MOTION},
                                                           {"network", MAQ_PREDICTION_NETWORK}})));
  for_pictures(command->add_flag(
      "-c,--compare", options->compare,
      "Print the error (PSNR) of last and motion by time ahead, and draw truth and all of them side by "
      "side, smaller where a clip takes no picture as wide"));
  CLI::Option* const samples =
      command->add_option("--samples", options->drawn.samples,
                          "Draw so many (1 to 16) of what may come by a network, and show how uncertain it is");
  for_pictures(samples->check(CLI::Range(1, 16)));
  command
      ->add_option("--temperature", options->drawn.temperature,
                   "Of samples: 1 (default) draws by the probabilities, 0 takes the likeliest")
      ->check(CLI::NonNegativeNumber)
      ->needs(samples);
  command->add_option("--top-k", options->drawn.top_k, "Of samples: only so many of the likeliest; default: all")
      ->check(CLI::Range(0u, 512u))
      ->needs(samples);
  command->add_option("--seed", options->drawn.seed, "Of samples: equal seeds draw the same; default: 0")
      ->needs(samples);
  command
      ->add_option("--passes", options->drawn.passes,
                   "Of samples: all places at once, so many times (1 to 16); default: exactly, one after another")
      ->check(CLI::Range(1u, 16u))
      ->needs(samples);
  command->add_option("-t,--threads", options->threads, "Threads; default: the large cores, at most 4")
      ->check(CLI::Range(0, 64));
  command->add_option("-o,--out", options->out,
                      "Clip (.mp4 or .avi), or folder for PNG files; with --surprise a clip that shows where, what the "
                      "network saw, and the curve");
  command->add_flag("--json", options->json, "Print one JSON document, or with --surprise a line a frame");
  command->footer(
      "A clip begins with the last second that was seen; predicted frames have a border and say how far ahead they\n"
      "are, and PNG files are marked inside. PSNR in dB: higher is nearer to the truth, +1 dB is an error 11 % "
      "smaller.\n\n"
      "Examples:\n"
      "  maquette predict clip.mp4 --from 40 --frames 16 --compare --out next.mp4\n"
      "  maquette predict clip.mp4 --from 40 --compare            # the figures alone\n"
      "  maquette predict 'stub:people?count=2' --method motion --out next/\n"
      "  maquette predict clip.mp4 --method network --compare --out mended.mp4\n"
      "  maquette predict clip.mp4 --samples 4 --temperature 0.7 --seed 3 --compare --out may.mp4\n"
      "  maquette predict v4l2:/dev/video0 --from 60 --frames 10 --out next.mp4\n"
      "  maquette predict camera: --surprise --events 6           # what stands out: cuts, a frozen or covered camera\n"
      "  maquette predict clip.mp4 --surprise --out surprise.mp4");
  command->callback([=] {
    if (!*is_surprise) {
      options->drawn.bundle = surprise->bundle.empty() ? default_prediction_bundle() : surprise->bundle;
      *exit_code = predict(*options);
      return;
    }
    surprise->source = options->source;
    surprise->threads = options->threads;
    surprise->json = options->json;
    surprise->out = options->out;
    *exit_code = run_surprise(*surprise);
  });
}
