#include "pipeline/pipeline.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/error.h"
#include "core/thread.h"
#include "core/trace/trace_section.h"
#include "pipeline/thread_priority.h"
#include "sources/recording/recording.h"
#include "sources/registry.h"

namespace maq {
namespace {

using Clock = MonotonicClock;

constexpr int64_t kWaitSliceNs = 50000000;  // how long a wait for a frame may hold up a request
constexpr std::chrono::milliseconds kOpeningPatience(50);
constexpr size_t kMaxReports = 1000;  // that wait for a callback that hangs

double ms_between(Clock::time_point begin, Clock::time_point end) {
  return std::chrono::duration<double, std::milli>(end - begin).count();
}

// How many events a second there were lately.
class EventRate {
 public:
  double add(Clock::time_point time) {
    times_[count_++ % times_.size()] = time;
    size_t recent = 1;
    while (recent < std::min(count_, times_.size()) && time - at(recent) <= std::chrono::seconds(1)) ++recent;
    return recent < 2 ? 0 : double(recent - 1) * 1000 / ms_between(at(recent - 1), time);
  }

 private:
  // `back` events before the latest.
  Clock::time_point at(size_t back) const { return times_[(count_ - 1 - back) % times_.size()]; }

  std::array<Clock::time_point, 128> times_{};
  size_t count_ = 0;
};

// The latest wishes of callers. The numbers count the changes.
struct Request {
  std::string uri;                      // "": no source
  std::shared_ptr<LiveModelUse> model;  // nullptr: none runs
  std::string recording;
  uint64_t source_number = 0, model_number = 1, recording_number = 0;
};

}  // namespace

// The state that the pipeline and its thread share. The thread may outlive the pipeline.
struct Pipeline::State {
  const PipelineSettings settings;

  mutable std::mutex mutex;  // of the members down to "Of the thread alone"
  std::condition_variable changed;
  Request request;
  uint64_t request_number = 0;
  bool is_paused = false;
  bool is_ending = false;    // the thread shall end
  bool has_ended = false;    // it has
  bool is_opening = false;   // it opens a source, which may hang
  bool in_callback = false;  // it is in a callback of the app
  bool is_photo = false;     // the source has one frame
  // State of the thread: stopped, opening, loading, running, ended or failed. While it runs, state of the camera:
  // running, stalled or reconnecting.
  maq_pipeline_state phase = MAQ_PIPELINE_STOPPED, camera = MAQ_PIPELINE_RUNNING;
  maq_status failure = MAQ_OK;
  std::string problem, camera_problem;
  PipelineStatus noted;  // the latest that was queued
  std::deque<PipelineStatus> reports;
  bool has_result = false;
  Frame newest_frame;
  std::unique_ptr<LiveOutput> newest_output;
  PipelineStats counts;
  std::shared_ptr<LiveModelUse> model;  // the one that is loaded; the thread alone runs it

  // Used only by the thread. Source and model are done when their numbers equal the request's.
  Request now;
  uint64_t heard_number = 0;
  std::unique_ptr<Source> source;
  uint64_t source_number = 0;
  uint64_t model_number = 0;
  std::unique_ptr<RecordingWriter> recording;
  uint64_t recording_number = 0;
  Frame frame;
  std::unique_ptr<LiveOutput> output;
  std::optional<Clock::time_point> waiting_since;
  EventRate rate;

  std::thread thread;  // of the pipeline

  explicit State(PipelineSettings given) : settings(std::move(given)) {}

  // --- with the mutex locked

  PipelineStatus status() const {
    if (phase != MAQ_PIPELINE_RUNNING) return {phase, failure, problem};
    if (is_paused) return {MAQ_PIPELINE_PAUSED, failure, problem};
    if (camera == MAQ_PIPELINE_RUNNING) return {camera, failure, problem};
    return {camera, camera == MAQ_PIPELINE_STALLED ? MAQ_TIMEOUT : MAQ_ERROR_DEVICE_LOST, camera_problem};
  }

  // After each change: wakes the calls that wait for it, and queues a report.
  void note_change() {
    changed.notify_all();
    PipelineStatus latest = status();
    const bool same = latest.state == noted.state && latest.status == noted.status && latest.problem == noted.problem;
    if (same) return;
    noted = latest;
    if (settings.on_state && reports.size() < kMaxReports) reports.push_back(std::move(latest));
  }

  void enter(maq_pipeline_state next, maq_status with = MAQ_OK, std::string sentence = {}) {
    phase = next;
    failure = with;
    problem = std::move(sentence);
    note_change();
  }

  void drop_waiting_result() {
    has_result = false;
    newest_frame.clear();
  }

  bool is_current() const {
    return !is_ending && request.source_number == now.source_number && request.model_number == now.model_number;
  }

  // --- on the thread

  void run() noexcept {
    lower_priority_of_this_thread(settings.nice);
    while (wait_for_work()) {
      try {
        if (!report_a_change()) step();
      } catch (...) {
        fail(current_failure());
      }
    }
    close_source();
    now.model.reset();
    show_model(nullptr);
    std::lock_guard<std::mutex> lock(mutex);
    has_ended = true;
    changed.notify_all();
  }

  // Until there is a request, a change to be reported or a frame to be mapped. False when the thread shall end.
  bool wait_for_work() {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] {
      return is_ending || !reports.empty() || request_number != heard_number ||
             (phase == MAQ_PIPELINE_RUNNING && !is_paused);
    });
    return !is_ending;
  }

  template <class Call>
  void call_back(std::unique_lock<std::mutex>& lock, Call&& call) {
    struct Guard {
      State& state;
      std::unique_lock<std::mutex>& lock;
      ~Guard() {
        lock.lock();
        state.in_callback = false;
        state.changed.notify_all();
      }
    };
    in_callback = true;
    lock.unlock();
    const Guard guard{*this, lock};
    call();
  }

  // False when there is none.
  bool report_a_change() {
    std::unique_lock<std::mutex> lock(mutex);
    if (reports.empty()) return false;
    const PipelineStatus report = std::move(reports.front());
    reports.pop_front();
    call_back(lock, [&] { settings.on_state(report); });
    return true;
  }

  // Does what the latest request asks for, or processes the next frame.
  void step() {
    maq_pipeline_state at = MAQ_PIPELINE_STOPPED;
    {
      std::lock_guard<std::mutex> lock(mutex);
      if (request_number != heard_number) {
        heard_number = request_number;
        // Before what may fail: a failure is one of this request, and not of an earlier one.
        now.source_number = request.source_number;
        now.model_number = request.model_number;
        now = request;
      }
      at = phase;
    }
    if (at == MAQ_PIPELINE_FAILED) return;
    if (at == MAQ_PIPELINE_STOPPED) return close_source();
    const bool opens = source_number != now.source_number;
    const bool loads = model_number != now.model_number;
    if (opens && !open_source_of_request()) return;
    if (loads && !load_model()) return;
    if (opens || loads) {
      enter_if_current(MAQ_PIPELINE_RUNNING);
    } else if (at == MAQ_PIPELINE_RUNNING) {
      map_next_frame();
    }
  }

  // False when another request has come meanwhile.
  bool enter_if_current(maq_pipeline_state next) {
    std::lock_guard<std::mutex> lock(mutex);
    if (is_current() && (source != nullptr || next == MAQ_PIPELINE_ENDED)) enter(next, failure, problem);
    return is_current();
  }

  void fail(const Failure& why) noexcept {
    close_source();
    source_number = 0;
    if (why.status == MAQ_ERROR_INFERENCE) model_number = 0;
    std::lock_guard<std::mutex> lock(mutex);
    if (!is_current()) return;
    try {
      enter(MAQ_PIPELINE_FAILED, why.status, why.text);
    } catch (const std::exception&) {  // no memory for the text, or for reporting it
      phase = MAQ_PIPELINE_FAILED;
      failure = why.status;
      problem = kShortNoMemory;
      changed.notify_all();
    }
  }

  bool open_source_of_request() {
    close_source();
    {
      std::lock_guard<std::mutex> lock(mutex);
      is_opening = true;
      camera = MAQ_PIPELINE_RUNNING;
    }
    SourceSettings chosen = settings.source;
    chosen.user_data = this;
    chosen.on_state = [](void* self, maq_source_state state, const char* reason) {
      static_cast<State*>(self)->take_camera_state(state, reason);
    };
    struct Opened {
      State& state;
      ~Opened() {
        std::lock_guard<std::mutex> lock(state.mutex);
        state.is_opening = false;
        state.changed.notify_all();
      }
    };
    {
      const Opened opened{*this};
      source = open_source(now.uri, chosen);
    }
    source_number = now.source_number;
    waiting_since.reset();
    if (model != nullptr) (*model)->reset();
    std::lock_guard<std::mutex> lock(mutex);
    is_photo = source->info().frame_count == 1 && !source->info().is_live;
    counts.dropped_frames = 0;
    return is_current();
  }

  // On a thread of the source.
  void take_camera_state(maq_source_state state, const char* reason) {
    std::lock_guard<std::mutex> lock(mutex);
    switch (state) {
      case MAQ_SOURCE_STARTED:
      case MAQ_SOURCE_RECONNECTED: camera = MAQ_PIPELINE_RUNNING; break;
      case MAQ_SOURCE_STALLED:
        camera = MAQ_PIPELINE_STALLED;
        camera_problem = concatenate("The camera stalled: ", reason, ".");
        break;
      case MAQ_SOURCE_LOST:
        camera = MAQ_PIPELINE_RECONNECTING;
        camera_problem = concatenate("The camera was lost: ", reason, ".");
        break;
      case MAQ_SOURCE_RECONNECTING: break;  // follows the above
    }
    note_change();
  }

  void show_model(std::shared_ptr<LiveModelUse> next) {
    std::lock_guard<std::mutex> lock(mutex);
    model.swap(next);
  }

  bool load_model() {
    if (now.model != nullptr) {
      if (!enter_if_current(MAQ_PIPELINE_LOADING)) return false;
      // Before the load, which takes a while.
      while (report_a_change()) {
      }
    }
    show_model(nullptr);  // before the next one takes memory
    if (now.model != nullptr) (*now.model)->load();
    show_model(now.model);
    model_number = now.model_number;
    std::lock_guard<std::mutex> lock(mutex);
    return is_current();
  }

  void map_next_frame() {
    if (!waiting_since) waiting_since = Clock::now();
    frame.clear();
    try {
      const TraceSection trace("maquette acquire");
      const NextFrame next = source->next(kWaitSliceNs, frame);
      if (next == NextFrame::kTimeout) return;
      if (next == NextFrame::kEnd) {
        close_source();
        enter_if_current(MAQ_PIPELINE_ENDED);
        return;
      }
    } catch (const Error& error) {
      if (error.status() != MAQ_ERROR_UNREADABLE) throw;
      return note_problem({error.status(), error.what()});  // later frames can be read still, or the end follows
    }
    record_frame();
    const auto begin = Clock::now();
    if (model != nullptr) {
      (*model)->run(frame, source->intrinsics(), output);
    } else {
      output.reset();
    }
    deliver(ms_between(*std::exchange(waiting_since, std::nullopt), begin), begin);
  }

  void deliver(double wait_ms, Clock::time_point begin) {
    const auto end = Clock::now();
    const uint64_t dropped_frames = source->drops();
    std::unique_lock<std::mutex> lock(mutex);
    if (is_ending || request.source_number != now.source_number) return;
    PipelineTimes times{++counts.results, wait_ms, ms_between(begin, end), -1};
    if (source->info().is_live && frame.clock == MAQ_CLOCK_MONOTONIC) {
      times.age_ms = double(to_ns(end) - frame.timestamp_ns) * 1e-6;
    }
    counts.dropped_frames = dropped_frames;
    counts.results_per_second = rate.add(end);
    counts.latest = times;
    if (settings.on_result) {
      bool taken = false;
      call_back(lock, [&] { taken = settings.on_result(frame, output, times); });
      counts.dropped_results += taken ? 0 : 1;
    } else {
      counts.dropped_results += has_result ? 1 : 0;
      std::swap(newest_frame, frame);
      std::swap(newest_output, output);
      has_result = true;
      changed.notify_all();
    }
    lock.unlock();
    frame.clear();  // of a result that was dropped
  }

  // A disk that is full ends the recording, not the results.
  void record_frame() {
    try {
      if (recording_number != now.recording_number) {
        recording_number = now.recording_number;
        end_recording();
        if (!now.recording.empty()) {
          RecordingInfo info{now.uri, source->info().fps, {}};
          if (source->intrinsics() != nullptr) info.intrinsics = *source->intrinsics();
          recording = std::make_unique<RecordingWriter>(now.recording, info, 0);
        }
      }
      if (recording != nullptr) recording->add(frame);
    } catch (const Error& error) {
      recording.reset();
      note_problem({error.status(), error.what()});
    }
  }

  void end_recording() {
    const std::unique_ptr<RecordingWriter> ended = std::move(recording);
    if (ended != nullptr) ended->finish();
  }

  void note_problem(const Failure& why) noexcept {
    std::lock_guard<std::mutex> lock(mutex);
    if (!is_current()) return;
    failure = why.status;
    try {
      problem = why.text;
      note_change();
    } catch (const std::exception&) {
      problem = kShortNoMemory;
    }
  }

  void close_source() noexcept {
    try {
      end_recording();
    } catch (const std::exception&) {
      note_problem(current_failure());
    }
    frame.clear();
    source.reset();
  }
};

Pipeline::Pipeline(PipelineSettings settings) : state_(std::make_shared<State>(std::move(settings))) {
  state_->thread = start_thread("maq pipeline", [state = state_] { state->run(); });
}

Pipeline::~Pipeline() {
  State& state = *state_;
  stop();
  std::unique_lock<std::mutex> lock(state.mutex);
  state.is_ending = true;
  if (state.model != nullptr) (*state.model)->cancel();
  state.changed.notify_all();
  bool waits = state.thread.get_id() != std::this_thread::get_id();
  const auto patience_ends = Clock::now() + kOpeningPatience;
  while (waits && !state.has_ended) {
    if (!state.is_opening) {
      state.changed.wait(lock);
    } else if (state.changed.wait_until(lock, patience_ends) == std::cv_status::timeout) {
      waits = !state.is_opening;
    }
  }
  lock.unlock();
  if (waits) {
    state.thread.join();
  } else {
    state.thread.detach();  // it holds the state itself, and ends after the callback or when the device answers
  }
}

void Pipeline::set_source(const std::string& uri) {
  std::lock_guard<std::mutex> lock(state_->mutex);
  state_->request.uri = uri;
  ++state_->request.source_number;
  ++state_->request_number;
  state_->drop_waiting_result();
  state_->enter(MAQ_PIPELINE_OPENING);
}

void Pipeline::set_model(const std::shared_ptr<LiveModel>& model) {
  std::shared_ptr<LiveModelUse> use = model != nullptr ? model->use_for(this) : nullptr;
  std::lock_guard<std::mutex> lock(state_->mutex);
  State& state = *state_;
  state.request.model.swap(use);
  ++state.request.model_number;
  ++state.request_number;
  // A photo may be mapped already while its end is not told yet.
  const bool maps_photo = state.is_photo && (state.phase == MAQ_PIPELINE_RUNNING || state.phase == MAQ_PIPELINE_ENDED);
  const bool again = state.phase == MAQ_PIPELINE_FAILED || maps_photo;
  if (state.phase == MAQ_PIPELINE_RUNNING) state.enter(MAQ_PIPELINE_LOADING, state.failure, state.problem);
  if (!again) return;
  ++state.request.source_number;
  state.enter(MAQ_PIPELINE_OPENING);
}

void Pipeline::set_paused(bool is_paused) {
  std::lock_guard<std::mutex> lock(state_->mutex);
  state_->is_paused = is_paused;
  state_->note_change();
}

void Pipeline::set_recording(const std::string& path) {
  std::lock_guard<std::mutex> lock(state_->mutex);
  state_->request.recording = path;
  ++state_->request.recording_number;
  ++state_->request_number;
  state_->changed.notify_all();
}

void Pipeline::stop() {
  State& state = *state_;
  std::unique_lock<std::mutex> lock(state.mutex);
  state.request.uri.clear();
  ++state.request.source_number;
  ++state.request_number;
  state.drop_waiting_result();
  state.enter(MAQ_PIPELINE_STOPPED);
  state.reports.clear();
  if (state.thread.get_id() == std::this_thread::get_id()) return;
  state.changed.wait(lock, [&] { return !state.in_callback; });
}

maq_status Pipeline::acquire(int64_t timeout_ns, Frame& frame, std::unique_ptr<LiveOutput>& output,
                             PipelineTimes& times) {
  const std::shared_ptr<State> state = state_;
  std::unique_lock<std::mutex> lock(state->mutex);
  const auto is_over = [&] {
    return state->has_result || state->phase == MAQ_PIPELINE_STOPPED || state->phase == MAQ_PIPELINE_ENDED ||
           state->phase == MAQ_PIPELINE_FAILED;
  };
  if (timeout_ns < 0) {
    state->changed.wait(lock, is_over);
  } else {
    state->changed.wait_until(lock, deadline_after(timeout_ns), is_over);
  }
  if (state->has_result) {
    std::swap(frame, state->newest_frame);
    std::swap(output, state->newest_output);
    times = state->counts.latest;
    state->has_result = false;
    return MAQ_OK;
  }
  switch (state->phase) {
    case MAQ_PIPELINE_STOPPED: return MAQ_CANCELLED;
    case MAQ_PIPELINE_ENDED: return MAQ_END_OF_STREAM;
    case MAQ_PIPELINE_FAILED: throw Error(state->failure, state->problem);
    default: return MAQ_TIMEOUT;
  }
}

PipelineStatus Pipeline::status() const {
  std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->status();
}

std::string Pipeline::source_uri() const {
  std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->request.uri;
}

PipelineStats Pipeline::stats() const {
  std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->counts;
}

}  // namespace maq
