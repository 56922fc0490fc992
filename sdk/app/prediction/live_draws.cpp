#include "app/prediction/live_draws.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "app/thread_priority.h"

namespace maquette {
namespace {

using DrawClock = std::chrono::steady_clock;

constexpr int32_t kDrawnSidePx = 256;     // networks see 64 pixels a side, motion some more
constexpr int64_t kMinStepNs = 60000000;  // between frames that networks are shown, which know steps of up to 0.1 s
constexpr size_t kMaxFramesWaiting = 16;  // while one draw is made and another rested for
constexpr double kTrainedStepS = 0.1;     // the longest that the networks know
constexpr float kCalmTemperature = 0.5f;  // at 1 places have errors of their own, and pictures flicker

}  // namespace

LiveDraws::LiveDraws(const Context& context, const std::string& bundle, const DrawChoice& choice, bool rests,
                     std::function<void()> on_change)
    : context_(context), bundle_(bundle), rests_(rests), on_change_(std::move(on_change)), choice_(choice) {
  thread_ = std::thread([this] { run(); });
}

LiveDraws::~LiveDraws() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void LiveDraws::push(const Frame& frame) {
  const maq_frame_desc desc = frame.desc();
  const int64_t step_ns = desc.timestamp_ns - pushed_ns_;
  if (rests_ && has_pushed_ && step_ns >= 0 && step_ns < kMinStepNs) return;
  pushed_ns_ = desc.timestamp_ns, has_pushed_ = true;
  const double scale = std::min(1.0, double(kDrawnSidePx) / std::max(desc.width_px, desc.height_px));
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

void LiveDraws::set_choice(const DrawChoice& choice) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (choice_.ahead_s == choice.ahead_s && choice_.makes_picture == choice.makes_picture) return;
    choice_ = choice;
    is_due_ = true;
  }
  wake_.notify_one();
}

void LiveDraws::wait() {
  std::unique_lock<std::mutex> lock(mutex_);
  drawn_one_.wait(lock, [&] { return (!is_due_ && !is_drawing_) || !problem_.empty(); });
}

bool LiveDraws::take(DrawnFuture& drawn) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!has_newest_) return false;
  std::swap(drawn, newest_);
  has_newest_ = false;
  return true;
}

std::string LiveDraws::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void LiveDraws::run() {
  if (rests_) lower_priority_of_this_thread();
  std::string problem;
  try {
    draw_until_the_end();
  } catch (const std::exception& error) {
    problem = error.what();
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    problem_ = problem;
    if (ends_ || problem.empty()) return;
  }
  drawn_one_.notify_all();
  on_change_();
}

// Frames are shown to the networks as they come, also while the thread rests between draws: they see several of the
// latest.
void LiveDraws::draw_until_the_end() {
  maq_predictor_config config = default_predictor_config();
  config.method = MAQ_PREDICTION_NETWORK;
  config.network_mode = MAQ_NETWORK_DRAWN;
  config.temperature = kCalmTemperature;
  config.threads = 1;
  if (!bundle_.empty()) config.bundle_path = bundle_.c_str();
  Predictor predictor(context_, config);
  DrawClock::time_point rested_at = DrawClock::now();
  int64_t latest_ns = 0;
  bool has_frame = false;
  uint64_t number = 0;
  while (true) {
    std::deque<Frame> frames;
    DrawChoice choice;
    bool draws = false;
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
      draws = is_due_ && (has_frame || !frames.empty()) && DrawClock::now() >= rested_at;
      if (draws) is_due_ = false, is_drawing_ = true;
    }
    for (const Frame& frame : frames) {
      predictor.push(frame);
      latest_ns = frame.desc().timestamp_ns;
      has_frame = true;
    }
    if (!draws) continue;
    const DrawClock::time_point begin = DrawClock::now();
    DrawnFuture drawn = draw(predictor, choice, latest_ns);
    const DrawClock::time_point end = DrawClock::now();
    drawn.draw_ms = std::chrono::duration<double, std::milli>(end - begin).count();
    drawn.number = ++number;
    if (rests_) rested_at = end + (end - begin);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      newest_ = std::move(drawn);
      has_newest_ = true;
      is_drawing_ = false;
    }
    drawn_one_.notify_all();
    on_change_();
  }
}

DrawnFuture LiveDraws::draw(Predictor& predictor, const DrawChoice& choice, int64_t timestamp_ns) const {
  const auto count = uint32_t(std::max(1.0, std::ceil(choice.ahead_s / kTrainedStepS - 1e-6)));
  predictor.draw(1, count, std::max(1e-3, choice.ahead_s / count));
  DrawnFuture drawn;
  drawn.bits = predictor.uncertainty(0, count);
  for (const float own : drawn.bits) drawn.mean_bits += double(own) / double(drawn.bits.size());
  if (choice.makes_picture) drawn.picture.copy_from(predictor.drawn(0, count));
  drawn.timestamp_ns = timestamp_ns;
  drawn.ahead_s = choice.ahead_s;
  return drawn;
}

}  // namespace maquette
