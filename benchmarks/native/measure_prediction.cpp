// Measures predicted frames of a clip and their time, and the delay of predicted frames of a concealer
// (benchmarks/prediction.py).
//
//   measure_prediction errors WIDTH HEIGHT FPS THREADS HORIZON... < frames    BGR, rows without padding
//   measure_prediction waits SECONDS URI
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <maquette/maquette.hpp>
#include <string>
#include <vector>

namespace {

// Predictions begin at every third frame from the fifth on: `auto` has seen enough frames by then.
constexpr size_t kFirstStart = 4, kStartStep = 3;

using Pixels = std::vector<uint8_t>;

double psnr_db(const Pixels& one, const Pixels& other) {
  double squares = 0;
  for (size_t i = 0; i < one.size(); ++i) squares += double((one[i] - other[i]) * (one[i] - other[i]));
  return 10 * std::log10(255.0 * 255.0 / std::max(squares / double(one.size()), 0.01));
}

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::ptrdiff_t(double(values.size() - 1) * fraction);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// CPU time of all threads of this process.
double processor_ms() { return double(std::clock()) * 1000 / CLOCKS_PER_SEC; }

maquette::Frame frame_of(const maquette::Context& context, const Pixels& pixels, int width, int height,
                         int64_t time_ns) {
  maq_frame_desc desc;
  maquette::check(maq_frame_desc_init(&desc, sizeof desc));
  desc.format = MAQ_PIXEL_BGR8;
  desc.width_px = width;
  desc.height_px = height;
  desc.planes[0] = pixels.data();
  desc.timestamp_ns = time_ns;
  return maquette::Frame(context, desc);
}

struct Sums {
  double last_db = 0, motion_db = 0, auto_db = 0;
  double motion_fraction = 0;  // in the blend of auto
};

int measure_errors(int width, int height, double fps, int threads, const std::vector<size_t>& horizons) {
  std::vector<Pixels> frames;
  for (;;) {
    Pixels pixels(size_t(width) * size_t(height) * 3);
    if (std::fread(pixels.data(), 1, pixels.size(), stdin) != pixels.size()) break;
    frames.push_back(std::move(pixels));
  }
  const maquette::Context context;
  maq_predictor_config config = maquette::default_predictor_config();
  config.model.threads = threads;
  maquette::Predictor automatic(context, config);
  config.method = MAQ_PREDICTOR_MOTION;
  maquette::Predictor motion(context, config);
  const size_t farthest = *std::max_element(horizons.begin(), horizons.end());
  std::vector<Sums> sums(horizons.size());
  std::vector<double> push_ms, auto_push_ms, predict_ms, push_cpu_ms, predict_cpu_ms;
  Pixels predicted(size_t(width) * size_t(height) * 3);
  int starts = 0;
  for (size_t i = 0; i + farthest < frames.size(); ++i) {
    const maquette::Frame frame = frame_of(context, frames[i], width, height, int64_t(double(i) * 1e9 / fps));
    const double before_push_ms = processor_ms();
    motion.push(frame);
    const double after_push_ms = processor_ms();
    automatic.push(frame);
    if (i < kFirstStart) continue;
    push_cpu_ms.push_back(after_push_ms - before_push_ms);
    push_ms.push_back(double(motion.stats().push_ms));
    auto_push_ms.push_back(double(automatic.stats().push_ms));
    if ((i - kFirstStart) % kStartStep != 0) continue;
    ++starts;
    for (size_t k = 0; k < horizons.size(); ++k) {
      const Pixels& truth = frames[i + horizons[k]];
      const double ahead_s = double(horizons[k]) / fps;
      sums[k].last_db += psnr_db(frames[i], truth);
      const double before_ms = processor_ms();
      const maquette::Frame moved = motion.predict(ahead_s);
      predict_cpu_ms.push_back(processor_ms() - before_ms);
      moved.copy_pixels(MAQ_PIXEL_BGR8, predicted.data(), 0, predicted.size());
      predict_ms.push_back(double(motion.stats().predict_ms));
      sums[k].motion_db += psnr_db(predicted, truth);
      automatic.predict(ahead_s).copy_pixels(MAQ_PIXEL_BGR8, predicted.data(), 0, predicted.size());
      sums[k].motion_fraction += double(automatic.stats().motion_fraction);
      sums[k].auto_db += psnr_db(predicted, truth);
    }
  }
  std::printf(
      "{\"starts\": %d, \"push_ms\": %.4f, \"auto_push_ms\": %.4f, \"predict_ms\": %.4f, "
      "\"cpu_ms\": %.4f, \"horizons\": [",
      starts, quantile(push_ms, .5), quantile(auto_push_ms, .5), quantile(predict_ms, .5),
      quantile(push_cpu_ms, .5) + quantile(predict_cpu_ms, .5));
  for (size_t k = 0; k < horizons.size(); ++k) {
    std::printf(
        "%s{\"frames\": %zu, \"last_db\": %.4f, \"motion_db\": %.4f, \"auto_db\": %.4f, "
        "\"motion_fraction\": %.4f}",
        k == 0 ? "" : ", ", horizons[k], sums[k].last_db / starts, sums[k].motion_db / starts, sums[k].auto_db / starts,
        sums[k].motion_fraction / starts);
  }
  std::printf("]}\n");
  return 0;
}

int measure_waits(double seconds, const std::string& uri) {
  const maquette::Context context;
  maquette::Source source(context, uri);
  maquette::Concealer concealer(context, source);
  std::vector<double> waits_ms;
  int64_t first_ns = -1, captured = 0;
  while (const auto frame = concealer.next()) {
    const maq_frame_desc desc = frame->desc();
    if (first_ns < 0) first_ns = desc.timestamp_ns;
    if (double(desc.timestamp_ns - first_ns) > seconds * 1e9) break;
    if (frame->is_predicted()) {
      waits_ms.push_back(double(concealer.stats().latest_wait_ms));
    } else {
      ++captured;
    }
  }
  std::printf(
      "{\"captured\": %lld, \"predicted\": %zu, \"wait_ms\": {\"median\": %.4f, \"p99\": %.4f, \"max\": %.4f}}\n",
      (long long)captured, waits_ms.size(), quantile(waits_ms, .5), quantile(waits_ms, .99), quantile(waits_ms, 1));
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 4 && std::strcmp(argv[1], "waits") == 0) return measure_waits(std::atof(argv[2]), argv[3]);
  if (argc > 6 && std::strcmp(argv[1], "errors") == 0) {
    std::vector<size_t> horizons;
    for (int i = 6; i < argc; ++i) horizons.push_back(size_t(std::atoi(argv[i])));
    return measure_errors(std::atoi(argv[2]), std::atoi(argv[3]), std::atof(argv[4]), std::atoi(argv[5]), horizons);
  }
  std::fprintf(stderr,
               "usage: measure_prediction errors WIDTH HEIGHT FPS THREADS HORIZON... < frames\n"
               "       measure_prediction waits SECONDS URI\n");
  return 2;
} catch (const std::exception& error) {
  std::fprintf(stderr, "measure_prediction: %s\n", error.what());
  return 1;
}
