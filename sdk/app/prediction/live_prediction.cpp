#include "app/prediction/live_prediction.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "app/thread_priority.h"

namespace maquette {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int64_t kPatienceNs = 20000000;  // delay of a changed choice while no frame comes
constexpr double kMaxAheadS = 10;          // of a predictor
constexpr auto kRetryFor = std::chrono::seconds(2), kSecond = std::chrono::seconds(1);
constexpr auto kRetryEvery = std::chrono::milliseconds(100), kCloseWithin = std::chrono::milliseconds(200);
constexpr double kFreshMs = 500, kStaleMs = 2000;
constexpr uint32_t kFramesHeld = 3;
constexpr size_t kMaxStatesKept = 1000, kMaxMomentsKept = 300;

std::string whole(double value) { return std::to_string(std::lround(value)); }

}  // namespace

std::string text_of_method(const maq_predictor_stats& stats) {
  if (stats.method == MAQ_PREDICTOR_LAST) return "last";
  if (stats.method == MAQ_PREDICTOR_MOTION) return "motion";
  return whole(100 * double(stats.motion_fraction)) + " % motion";
}

std::string text_of_next(const PredictionFrame& frame, bool has_entropy) {
  const std::string text = "predicted +" + whole(frame.predicted_ahead_s * 1e3) + " ms, " + text_of_method(frame.stats);
  if (!has_entropy) return text;
  if (frame.sampled.number == 0) return text + "; no entropy yet";
  return text + "; red: uncertain, " + whole(frame.sample_age_ms) + " ms old";
}

std::string text_of_sample(const PredictionFrame& frame) {
  return "sample +" + whole(frame.sampled.ahead_s * 1e3) + " ms, " + whole(frame.sample_age_ms) + " ms old";
}

LivePrediction::LivePrediction(const Context& context, const PredictionChoice& choice,
                               std::function<void(const PredictionFrame&)> on_frame, std::function<void()> on_change,
                               const LiveOptions& options)
    : context_(context), on_frame_(std::move(on_frame)), on_change_(std::move(on_change)), options_(options) {
  wanted_.choice = choice;
  thread_ = std::thread([this] { run(); });
}

LivePrediction::~LivePrediction() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void LivePrediction::open(const std::string& uri, const std::string& fallback) {
  const std::lock_guard<std::mutex> lock(mutex_);
  status_ = {};
  status_.uri = uri;
  fallback_ = fallback;
  wanted_.recording.clear();  // it ends with its source
  opens_ = true, is_open_ = false;
  retry_until_ = Clock::now() + kRetryFor;
  wake_.notify_one();
}

void LivePrediction::close() {
  open("");
  std::unique_lock<std::mutex> lock(mutex_);
  closed_.wait_for(lock, kCloseWithin, [&] { return !opens_; });
}

void LivePrediction::set_paused(bool is_paused) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wanted_.is_paused = is_paused;
  is_changed_ = true;
  wake_.notify_one();
}

void LivePrediction::set_recording(const std::string& path) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wanted_.recording = path;
  is_changed_ = true;
  wake_.notify_one();
}

void LivePrediction::set_choice(const PredictionChoice& choice) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wanted_.choice = choice;
  is_changed_ = true;
  wake_.notify_one();
}

LiveStatus LivePrediction::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

void LivePrediction::run() {
  lower_priority_of_this_thread();
  while (true) {
    Wanted wanted;
    bool opens = false;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [&] {
        const bool plays = is_open_ && !status_.has_ended && !wanted_.is_paused;
        return ends_ || opens_ || is_changed_ || plays;
      });
      if (ends_) break;
      wanted = wanted_;
      opens = opens_;
      is_changed_ = false;
    }
    try {
      if (opens) {
        open_source();
      } else if (source_) {
        apply(wanted);
        if (!wanted.is_paused && !status().has_ended) {
          play_frame(wanted);
        } else if (has_pushed_) {
          const bool is_elsewhen = frame_.ahead_s != wanted.choice.ahead_s;
          if (is_elsewhen) predict(wanted.choice.ahead_s);
          if (take_sample() || is_elsewhen) on_frame_(frame_);
        }
      }
    } catch (const std::bad_alloc&) {
      end("There is not enough memory.");
    } catch (const std::exception& error) {
      end(error.what());
    }
  }
  close_source();
}

void LivePrediction::close_source() {
  recorder_.reset(), recording_.clear();
  concealer_.reset(), predictor_.reset(), health_.reset(), source_.reset(), samples_.reset();
  frame_.sampled = {};
  frame_.health.clear(), frame_.health_map.clear();
  has_pushed_ = false;
  times_.clear();
}

// Opens the source that is wanted now, which may be none.
void LivePrediction::open_source() {
  close_source();
  std::string uri;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    uri = status_.uri;
    opens_ = false;
    if (!uri.empty()) status_.state = MAQ_PIPELINE_OPENING, status_.activity = "Opening " + uri;
  }
  closed_.notify_all();
  if (uri.empty()) return;
  enter(MAQ_PIPELINE_OPENING, "");
  maq_source_config config = default_source_config();
  config.reconnect_ms = options_.reconnect_ms;
  config.real_time = config.loop = options_.real_time ? 1 : 0;
  config.max_side_px = options_.max_side_px;
  config.frame_pool_size = kFramesHeld;
  config.state_user_data = this;
  config.state_callback = [](void* self, maq_source_state state, const char* reason) {
    static_cast<LivePrediction*>(self)->take_camera_state(state, reason);
  };
  try {
    source_.emplace(context_, uri, &config);
  } catch (const Error& error) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (opens_ || ends_) return;
    if (error.status() == MAQ_ERROR_BUSY && Clock::now() < retry_until_) {
      wake_.wait_for(lock, kRetryEvery, [&] { return opens_ || ends_; });
      opens_ = true;
      return;
    }
    if (fallback_.empty()) throw;
    status_.uri = std::exchange(fallback_, "");
    fallback_reason_ = error.what();
    opens_ = true;
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_open_ = !opens_;
  }
  enter(MAQ_PIPELINE_RUNNING, std::exchange(fallback_reason_, ""));
}

// Applies the choices that changed.
void LivePrediction::apply(const Wanted& wanted) {
  if (recording_ != wanted.recording) {
    recorder_.reset();
    recording_ = wanted.recording;
    record([&] {
      if (!recording_.empty()) recorder_.emplace(context_, recording_, &*source_);
    });
  }
  const PredictionChoice& choice = wanted.choice;
  if (!predictor_ || method_ != choice.method) switch_method(choice);
  const bool conceals = choice.conceals_gaps && source_->info().is_live == 1;
  if (conceals && !concealer_) concealer_.emplace(context_, *source_);
  if (!conceals) concealer_.reset();
  if (health_.has_value() != choice.checks_camera) switch_health(choice.checks_camera);
  switch_samples(choice);
}

void LivePrediction::switch_method(const PredictionChoice& choice) {
  maq_predictor_config config = default_predictor_config();
  config.method = method_ = choice.method;
  predictor_.emplace(context_, config);
  has_pushed_ = false;
}

// Samples begin with the next frames.
void LivePrediction::switch_samples(const PredictionChoice& choice) {
  const SampleChoice sampling = {choice.ahead_s, choice.shows_sample};
  if (!choice.shows_entropy && !choice.shows_sample) {
    samples_.reset();
    frame_.sampled = {};
  } else if (samples_) {
    samples_->set_choice(sampling);
  } else {
    has_sample_problem_ = false;
    samples_.emplace(context_, choice.bundle, sampling, options_.real_time, [this] {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_changed_ = true;
      wake_.notify_one();
    });
  }
}

// Takes a newer sample if there is one. Without networks, the image goes on.
bool LivePrediction::take_sample() {
  if (!samples_) return false;
  const std::string problem = samples_->problem();
  if (!problem.empty() && !std::exchange(has_sample_problem_, true)) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      status_.problem = problem;
    }
    if (on_change_) on_change_();
  }
  const bool is_newer = samples_->take(frame_.sampled);
  if (frame_.sampled.number > 0) frame_.sample_age_ms = double(shown_ns_ - frame_.sampled.timestamp_ns) / 1e6;
  frame_.sample_freshness = std::clamp((kStaleMs - frame_.sample_age_ms) / (kStaleMs - kFreshMs), 0.0, 1.0);
  return is_newer;
}

void LivePrediction::switch_health(bool is_on) {
  health_.reset();
  frame_.health.clear(), frame_.health_map.clear();
  if (is_on) health_.emplace(context_);
}

// When the disk is full, the image goes on.
void LivePrediction::record(const std::function<void()>& step) {
  try {
    step();
  } catch (const Error& error) {
    recorder_.reset();
    enter(MAQ_PIPELINE_RUNNING, error.what());
  }
}

void LivePrediction::check_camera(const Frame& frame) {
  const int64_t timestamp_ns = frame.desc().timestamp_ns;
  if (frame_.health.empty()) first_ns_ = timestamp_ns;
  frame_.health.push_back({health_->push(frame), double(timestamp_ns - first_ns_) / 1e9});
  if (frame_.health.size() > kMaxMomentsKept) frame_.health.pop_front();
  frame_.health_map = health_->map();
  frame_.health_ms = double(health_->stats().push_ms);
}

void LivePrediction::play_frame(const Wanted& wanted) {
  const Clock::time_point before = Clock::now();
  std::optional<Frame> frame;
  try {
    frame = concealer_ ? concealer_->next(kPatienceNs) : source_->next(kPatienceNs);
  } catch (const Error& error) {
    if (error.status() != MAQ_TIMEOUT) throw;
    return;
  }
  if (!frame) return end("");
  frame_.waiting_ms = std::chrono::duration<double, std::milli>(Clock::now() - before).count();
  show(std::move(*frame), wanted);
}

void LivePrediction::show(Frame frame, const Wanted& wanted) {
  const maq_frame_desc desc = frame.desc();
  frame_.origin = frame.origin();
  shown_ns_ = desc.timestamp_ns;
  // A predicted frame has no news.
  if (frame_.origin.kind != MAQ_FRAME_PREDICTED || !has_pushed_) {
    record([&] {
      if (recorder_ && frame_.origin.kind != MAQ_FRAME_PREDICTED) recorder_->add(frame);
    });
    predictor_->push(frame);
    if (health_ && frame_.origin.kind != MAQ_FRAME_PREDICTED) check_camera(frame);
    if (samples_ && frame_.origin.kind != MAQ_FRAME_PREDICTED) {
      samples_->push(frame);
      if (!options_.real_time) samples_->wait();
    }
    pushed_ns_ = shown_ns_;
    has_pushed_ = true;
  }
  frame_.now.copy_from(frame);
  frame_.conceals_gaps = concealer_.has_value();
  frame_.gaps = concealer_ ? concealer_->stats() : maq_concealer_stats{};
  predict(wanted.choice.ahead_s);
  take_sample();
  const Clock::time_point now = Clock::now();
  times_.push_back(now);
  while (now - times_.front() > kSecond) times_.pop_front();
  const double passed_s = std::chrono::duration<double>(now - times_.front()).count();
  frame_.results_per_second = passed_s > 0 ? double(times_.size() - 1) / passed_s : 0;
  ++frame_.number;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.dropped_frames = source_->info().dropped_frame_count;
  }
  on_frame_(frame_);
  if (options_.max_results != 0 && frame_.number >= options_.max_results) end("");
}

void LivePrediction::predict(double ahead_s) {
  frame_.ahead_s = ahead_s;
  frame_.predicted_ahead_s = std::clamp(ahead_s + double(shown_ns_ - pushed_ns_) / 1e9, 0.0, kMaxAheadS);
  frame_.next.copy_from(predictor_->predict(frame_.predicted_ahead_s));
  frame_.stats = predictor_->stats();
}

// Ends the source; no more frames come.
void LivePrediction::end(const std::string& problem) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (opens_) return;
    status_.has_ended = true;
    status_.has_failed = !problem.empty();
  }
  enter(problem.empty() ? MAQ_PIPELINE_ENDED : MAQ_PIPELINE_FAILED, problem);
}

// `problem`: "" keeps the text from before.
void LivePrediction::enter(maq_pipeline_state state, const std::string& problem) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (opens_) return;
    status_.state = state;
    if (status_.states.size() < kMaxStatesKept) status_.states.push_back(state);
    if (state != MAQ_PIPELINE_OPENING) status_.activity.clear();
    if (!problem.empty()) status_.problem = problem;
  }
  if (on_change_) on_change_();
}

// Called on a thread of the source.
void LivePrediction::take_camera_state(maq_source_state state, const char* reason) {
  if (state == MAQ_SOURCE_STARTED || state == MAQ_SOURCE_RECONNECTING) return;
  if (state == MAQ_SOURCE_RECONNECTED) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      status_.problem.clear();
    }
    return enter(MAQ_PIPELINE_RUNNING, "");
  }
  const bool is_lost = state == MAQ_SOURCE_LOST;
  enter(is_lost ? MAQ_PIPELINE_RECONNECTING : MAQ_PIPELINE_STALLED,
        std::string(is_lost ? "The camera was lost: " : "The camera stalled: ") + reason + ".");
}

}  // namespace maquette
