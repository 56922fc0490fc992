#include "app/prediction/live_samples.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "app/thread_priority.h"

namespace maquette {
namespace {

using SampleClock = std::chrono::steady_clock;

constexpr int32_t kSampledSidePx = 256;   // networks see 64 pixels a side, motion some more
constexpr int64_t kMinStepNs = 60000000;  // between frames of the networks, which know steps up to 0.1 s
constexpr size_t kMaxFramesWaiting = 16;  // during one sample and its rest
constexpr double kTrainedStepS = 0.1;     // the longest that the networks know
constexpr float kCalmTemperature = 0.5f;  // at 1, cells err independently and images flicker

}  // namespace

LiveSamples::LiveSamples(const Context& context, const std::string& bundle, const SampleChoice& choice, bool rests,
                         std::function<void()> on_change)
    : context_(context), bundle_(bundle), rests_(rests), on_change_(std::move(on_change)), choice_(choice) {
  thread_ = std::thread([this] { run(); });
}

LiveSamples::~LiveSamples() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void LiveSamples::push(const Frame& frame) {
  const maq_frame_desc desc = frame.desc();
  const int64_t step_ns = desc.timestamp_ns - pushed_ns_;
  if (rests_ && has_pushed_ && step_ns >= 0 && step_ns < kMinStepNs) return;
  pushed_ns_ = desc.timestamp_ns, has_pushed_ = true;
  const double scale = std::min(1.0, double(kSampledSidePx) / std::max(desc.width_px, desc.height_px));
  const auto scaled = [&](int32_t side_px) { return std::max(1, int(std::lround(side_px * scale))); };
  Frame copy = frame.resized(scaled(desc.width_px), scaled(desc.height_px));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (frames_.size() == kMaxFramesWaiting) frames_.pop_front();
    frames_.push_back(std::move(copy));
    is_due_ = true;
  }
  wake_.notify_one();
}

void LiveSamples::set_choice(const SampleChoice& choice) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (choice_.ahead_s == choice.ahead_s && choice_.decodes_image == choice.decodes_image) return;
    choice_ = choice;
    is_due_ = true;
  }
  wake_.notify_one();
}

void LiveSamples::wait() {
  std::unique_lock<std::mutex> lock(mutex_);
  sampled_.wait(lock, [&] { return (!is_due_ && !is_sampling_) || !problem_.empty(); });
}

bool LiveSamples::take(SampledFuture& sampled) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!has_newest_) return false;
  std::swap(sampled, newest_);
  has_newest_ = false;
  return true;
}

std::string LiveSamples::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void LiveSamples::run() {
  if (rests_) lower_priority_of_this_thread();
  std::string problem;
  try {
    sample_until_the_end();
  } catch (const std::exception& error) {
    problem = error.what();
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    problem_ = problem;
    if (ends_ || problem.empty()) return;
  }
  sampled_.notify_all();
  on_change_();
}

// The networks see several past frames, so frames are pushed as they come, also while the thread rests.
void LiveSamples::sample_until_the_end() {
  maq_predictor_config config = default_predictor_config();
  config.method = MAQ_PREDICTOR_SAMPLED;
  config.temperature = kCalmTemperature;
  config.model.threads = 1;
  if (!bundle_.empty()) config.model.bundle_path = bundle_.c_str();
  Predictor predictor(context_, config);
  SampleClock::time_point rested_at = SampleClock::now();
  int64_t latest_ns = 0;
  bool has_frame = false;
  uint64_t number = 0;
  while (true) {
    std::deque<Frame> frames;
    SampleChoice choice;
    bool samples = false;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      const auto has_work = [&] { return ends_ || !frames_.empty(); };
      if (is_due_ && has_frame) {
        wake_.wait_until(lock, rested_at, has_work);
      } else {
        wake_.wait(lock, [&] { return has_work() || (is_due_ && has_frame); });
      }
      if (ends_) return;
      frames.swap(frames_);
      choice = choice_;
      samples = is_due_ && (has_frame || !frames.empty()) && SampleClock::now() >= rested_at;
      if (samples) is_due_ = false, is_sampling_ = true;
    }
    for (const Frame& frame : frames) {
      predictor.push(frame);
      latest_ns = frame.desc().timestamp_ns;
      has_frame = true;
    }
    if (!samples) continue;
    const SampleClock::time_point begin = SampleClock::now();
    SampledFuture sampled = sample(predictor, choice, latest_ns);
    const SampleClock::time_point end = SampleClock::now();
    sampled.sample_ms = std::chrono::duration<double, std::milli>(end - begin).count();
    sampled.number = ++number;
    if (rests_) rested_at = end + (end - begin);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      newest_ = std::move(sampled);
      has_newest_ = true;
      is_sampling_ = false;
    }
    sampled_.notify_all();
    on_change_();
  }
}

SampledFuture LiveSamples::sample(Predictor& predictor, const SampleChoice& choice, int64_t timestamp_ns) const {
  const auto count = uint32_t(std::max(1.0, std::ceil(choice.ahead_s / kTrainedStepS - 1e-6)));
  predictor.sample(1, count, std::max(1e-3, choice.ahead_s / count));
  SampledFuture sampled;
  sampled.bits = predictor.entropy_map(0, count);
  for (const float own : sampled.bits) sampled.mean_bits += double(own) / double(sampled.bits.size());
  if (choice.decodes_image) sampled.image.copy_from(predictor.acquire_sample(0, count));
  sampled.timestamp_ns = timestamp_ns;
  sampled.ahead_s = choice.ahead_s;
  return sampled;
}

}  // namespace maquette
