#include "concealment/concealer.h"

#include <algorithm>
#include <array>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "core/clock.h"
#include "core/error.h"
#include "core/thread.h"

namespace maq {
namespace {

constexpr const char* kNotLive =
    "The source is not live: its frames come when they are asked for, so that there are no gaps to conceal. "
    "Add live=1 to its URI, or take its frames as they are.";

constexpr int64_t kSlice_ns = 20000000;  // how long a wait for a frame may hold up closing
constexpr int64_t kMinPeriod_ns = 1000000, kMaxPeriod_ns = 1000000000;  // between frames
constexpr int64_t kSlackPart = 8;  // of a period, by which frames may be late: cameras are not exact
constexpr size_t kSteps = 9, kKnownSteps = 5;

}  // namespace

// The state that the concealer and its thread share.
struct Concealer::State {
  const std::shared_ptr<Source> source;
  const int64_t max_gap_ns;

  mutable std::mutex mutex;  // of what follows, to the next such line
  std::condition_variable changed;
  bool is_closing = false;
  bool has_frame = false;  // `waiting`, for the app
  Frame waiting;
  bool is_over = false;  // the source has ended, was stopped or failed
  NextFrame ending = NextFrame::kEnd;
  std::exception_ptr failure;
  ConcealerStats counts;

  // The thread alone uses these.
  MotionPredictor predictor;
  Frame captured, made_up;
  bool has_made_up = false;                       // `made_up` is there for the next frame that does not come
  int64_t period_ns = 0;                          // between frames; 0: not known yet
  std::array<int64_t, kSteps> latest_steps_ns{};  // between captured frames, round and round
  size_t step_count = 0;
  int64_t captured_ns = 0;        // the timestamp of the latest captured frame
  int64_t latest_ns = INT64_MIN;  // of the latest frame for the app
  int64_t due_ns = INT64_MAX;     // by the clock, when the next one must be there
  int64_t steps = 0;              // frames that were due since the latest captured one

  std::thread thread;

  State(std::shared_ptr<Source> of, const ConcealerSettings& settings)
      : source(std::move(of)), max_gap_ns(int64_t(settings.max_gap_ms) * 1000000), predictor(settings.motion) {
    const double fps = source->info().fps;
    if (fps > 0) period_ns = std::clamp(int64_t(1e9 / fps), kMinPeriod_ns, kMaxPeriod_ns);
  }

  // Swaps the frame with the one that waits. The newest wins.
  void publish(Frame& frame) {
    std::lock_guard<std::mutex> lock(mutex);
    if (has_frame) ++counts.dropped;
    std::swap(waiting, frame);
    has_frame = true;
    changed.notify_all();
  }

  void run() noexcept {
    try {
      while (step()) {
      }
    } catch (...) {
      std::lock_guard<std::mutex> lock(mutex);
      failure = std::current_exception();
      is_over = true;
      changed.notify_all();
    }
  }

  // Until a frame has come or was due. False at the end.
  bool step() {
    {
      std::lock_guard<std::mutex> lock(mutex);
      if (is_closing) return false;
    }
    const int64_t now_ns = monotonic_ns();
    const bool is_due = has_made_up && now_ns >= due_ns;
    const int64_t wait_ns = is_due ? 0 : std::clamp<int64_t>(has_made_up ? due_ns - now_ns : kSlice_ns, 0, kSlice_ns);
    captured.clear();
    const NextFrame came = source->next(wait_ns, captured);
    if (came == NextFrame::kFrame) {
      take_captured();
    } else if (came != NextFrame::kTimeout) {
      std::lock_guard<std::mutex> lock(mutex);
      ending = came;
      is_over = true;
      changed.notify_all();
      return false;
    } else if (has_made_up && monotonic_ns() >= due_ns) {
      give_made_up();
    }
    return true;
  }

  void take_captured() {
    const int64_t now_ns = monotonic_ns(), time_ns = captured.timestamp_ns;
    note_step(time_ns);
    predictor.keep(captured);
    steps = 0;
    // One that a predicted frame stood for already is not shown any more: time would go back.
    const bool is_late = time_ns <= latest_ns;
    if (is_late && period_ns > 0) steps = (latest_ns - time_ns) / period_ns;
    {
      std::lock_guard<std::mutex> lock(mutex);
      ++(is_late ? counts.late : counts.captured);
    }
    if (!is_late) {
      latest_ns = time_ns;
      publish(captured);  // before motion is found: it does not wait for that
    }
    due_ns = now_ns + period_ns + period_ns / kSlackPart;
    predictor.follow();
    prepare();
  }

  // The frame interval is the median of the latest steps: some frames are lost, and stalls are long.
  void note_step(int64_t time_ns) {
    const int64_t step_ns = time_ns - std::exchange(captured_ns, time_ns);
    if (step_count++ == 0) return;  // the first frame
    latest_steps_ns[step_count % kSteps] = step_ns;
    const size_t known = std::min(step_count - 1, kSteps);
    if (known < kKnownSteps) return;
    // Steps that are not known yet are 0, the smallest.
    const size_t middle = kSteps - known + known / 2;
    for (const int64_t median_ns : latest_steps_ns) {
      size_t smaller = 0, equal = 0;
      for (const int64_t other_ns : latest_steps_ns) {
        smaller += other_ns < median_ns ? 1 : 0;
        equal += other_ns == median_ns ? 1 : 0;
      }
      if (smaller <= middle && middle < smaller + equal)
        period_ns = std::clamp(median_ns, kMinPeriod_ns, kMaxPeriod_ns);
    }
  }

  // The frame for the case that the next one does not come.
  void prepare() {
    const int64_t ahead_ns = (steps + 1) * period_ns;
    has_made_up = period_ns > 0 && ahead_ns <= max_gap_ns;
    if (has_made_up) predictor.predict(std::min(ahead_ns, MotionPredictor::kMaxAhead_ns), made_up);
  }

  void give_made_up() {
    ++steps;
    const float waited_ms = float(double(monotonic_ns() - due_ns) / 1e6);
    bool is_wanted = true;
    {
      std::lock_guard<std::mutex> lock(mutex);
      is_wanted = !has_frame || waiting.origin.is_predicted;  // an app that is slow gets the captured one
      counts.latest_gap_ms = float(double(steps * period_ns) / 1e6);
      counts.latest_wait_ms = waited_ms;
      counts.max_wait_ms = std::max(counts.max_wait_ms, waited_ms);
      if (is_wanted) ++counts.predicted;
    }
    if (is_wanted) {
      latest_ns = made_up.timestamp_ns;
      publish(made_up);
    }
    due_ns += period_ns;
    prepare();
  }
};

Concealer::Concealer(std::shared_ptr<Source> source, const ConcealerSettings& settings) {
  if (!source->info().is_live) {
    throw Error(MAQ_ERROR_UNSUPPORTED, kNotLive);
  }
  state_ = std::make_unique<State>(std::move(source), settings);
  state_->thread = start_thread("maq conceal", [state = state_.get()] { state->run(); });
}

Concealer::~Concealer() {
  {
    std::lock_guard<std::mutex> lock(state_->mutex);
    state_->is_closing = true;
    state_->changed.notify_all();
  }
  state_->thread.join();
}

NextFrame Concealer::next(int64_t timeout_ns, Frame& frame) {
  std::unique_lock<std::mutex> lock(state_->mutex);
  const auto is_there = [this] { return state_->has_frame || state_->is_over || state_->is_closing; };
  if (timeout_ns < 0) {
    state_->changed.wait(lock, is_there);
  } else if (!state_->changed.wait_until(lock, deadline_after(timeout_ns), is_there)) {
    return NextFrame::kTimeout;
  }
  if (state_->has_frame) {
    std::swap(frame, state_->waiting);
    state_->waiting.clear();
    state_->has_frame = false;
    return NextFrame::kFrame;
  }
  if (state_->failure) std::rethrow_exception(state_->failure);
  return state_->is_over ? state_->ending : NextFrame::kStopped;
}

ConcealerStats Concealer::stats() const {
  std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->counts;
}

}  // namespace maq
