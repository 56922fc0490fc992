#include "sources/live_source.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/error.h"
#include "core/files/event_fd.h"
#include "core/rounding.h"
#include "core/thread.h"
#include "image/depth.h"
#include "image/files/jpeg.h"

namespace maq {
namespace {

using Clock = MonotonicClock;
using std::chrono::milliseconds;

constexpr milliseconds kReconnectPause(100);
constexpr milliseconds kStopTimeout(40);     // part of the 50 ms that closing may take
constexpr uint32_t kMaxLostAtOnce = 100000;  // minutes of frames
constexpr int kMaxWaitMs = 200;              // a stall is noticed between two waits

// The largest JPEG image accepted for an agreed size: cameras also send smaller ones, and ones padded to whole blocks.
int64_t max_jpeg_pixels(const ImageView& agreed) {
  constexpr int64_t kBlock = 16;
  if (agreed.width_px == 0) return MAQ_MAX_PIXELS;
  return round_up<int64_t>(agreed.width_px, kBlock) * round_up<int64_t>(agreed.height_px, kBlock);
}

}  // namespace

// Shared by the source and its thread. The thread may outlive the source when the device hangs.
struct LiveSource::State {
  struct Entry {
    PixelLease lease;
    CameraBuffer buffer;
    uint64_t sequence = 0;
  };

  CameraOpener open;
  std::string name;
  SourceSettings settings;
  EventFd wake;

  std::mutex mutex;
  std::condition_variable changed;
  // A ring of queue_length frames: the newest replaces the oldest.
  std::vector<Entry> ring;
  size_t first = 0, count = 0;
  uint64_t dropped = 0;
  std::optional<std::string> failure;
  maq_status failure_status = MAQ_ERROR_DEVICE_LOST;
  bool at_end = false;  // after the frames that wait
  uint32_t seeks = 0;   // asked for; frames from before them are dropped
  bool stopping = false;
  bool reporting = false;  // the thread is in the caller's on_state
  bool ended = false;      // the thread
  std::thread thread;
  JpegDecoder jpeg;  // used by read() alone
  bool warned_of_bad_jpeg = false;
  std::optional<EventFd> news;  // for the app, once it has asked for it
  bool is_signalled = false;    // the news

  std::mutex control_mutex;                  // one call at a time; before `mutex`, and never taken by the thread
  std::weak_ptr<Camera> present;             // the thread owns the camera; empty while it is lost
  std::vector<ControlSetting> set_controls;  // the latest last

  void report(maq_source_state state, const std::string& reason) {
    settings.log.write(state == MAQ_SOURCE_STARTED || state == MAQ_SOURCE_RECONNECTED ? MAQ_LOG_INFO : MAQ_LOG_WARNING,
                       name, ": ", reason);
    if (settings.on_state == nullptr || !begin_report()) return;
    try {
      settings.on_state(settings.user_data, state, reason.c_str());
    } catch (const std::exception& error) {
      end_report();
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "its state callback threw an exception (", error.what(), ")");
    } catch (...) {
      end_report();
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "its state callback threw an exception");
    }
    end_report();
  }

  // False when the source was stopped: its end waits for a report that was begun, not for a later one.
  bool begin_report() {
    std::lock_guard<std::mutex> lock(mutex);
    reporting = !stopping;
    return reporting;
  }

  void end_report() {
    std::lock_guard<std::mutex> lock(mutex);
    reporting = false;
    changed.notify_all();
  }

  void wait_for_report() {
    if (std::this_thread::get_id() == thread.get_id()) return;
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return !reporting; });
  }

  void push(Entry entry) {
    Entry old;  // returned to the camera after the lock is released
    {
      std::lock_guard<std::mutex> lock(mutex);
      if (ring.empty()) return;  // the source is gone
      if (count == ring.size()) {
        old = std::move(ring[first]);
        first = (first + 1) % ring.size();
        --count;
        ++dropped;
      }
      ring[(first + count) % ring.size()] = std::move(entry);
      ++count;
      show_news();
    }
    changed.notify_all();
  }

  // The camera, for the length of a call. Throws while it is lost.
  std::shared_ptr<Camera> present_camera() {
    std::lock_guard<std::mutex> lock(mutex);
    if (stopping) throw Error(MAQ_CANCELLED, name, " was stopped.");
    std::shared_ptr<Camera> camera = present.lock();
    if (camera != nullptr) return camera;
    if (failure) throw Error(failure_status, *failure, ".");
    throw Error(MAQ_ERROR_DEVICE_LOST, name,
                " is not connected at the moment; try again when its state is MAQ_SOURCE_RECONNECTED.");
  }

  void show(const std::shared_ptr<Camera>& camera) {
    std::lock_guard<std::mutex> lock(mutex);
    present = camera;
  }

  // False when `camera` was lost meanwhile.
  bool remember(const std::shared_ptr<Camera>& camera, const ControlSetting& setting) {
    std::lock_guard<std::mutex> lock(mutex);
    if (present.lock() != camera) return false;
    const auto same = [&](const ControlSetting& other) { return other.which == setting.which; };
    set_controls.erase(std::remove_if(set_controls.begin(), set_controls.end(), same), set_controls.end());
    set_controls.push_back(setting);
    return true;
  }

  // Sets the controls that were set before the camera was lost.
  void restore_controls(Camera& camera) {
    std::vector<ControlSetting> before;
    {
      std::lock_guard<std::mutex> lock(mutex);
      before = set_controls;
    }
    for (const ControlSetting& setting : before) {
      try {
        camera.set_control(setting.which, setting.value);
      } catch (const std::exception& error) {
        settings.log.write(MAQ_LOG_WARNING, name, " is back without one of its controls: ", error.what());
      }
    }
  }

  bool is_stopping() {
    std::lock_guard<std::mutex> lock(mutex);
    return stopping;
  }

  // With the mutex locked: whether next() has something to say.
  bool is_ready() const { return count > 0 || failure || at_end || stopping; }

  // With the mutex locked, after each change of is_ready().
  void show_news() {
    if (!news || is_signalled == is_ready()) return;
    is_signalled = !is_signalled;
    if (is_signalled) {
      news->signal();
    } else {
      news->take();
    }
  }

  // Ends the thread, when the device answers, and the waits of others.
  void stop() {
    std::lock_guard<std::mutex> lock(mutex);
    stopping = true;
    show_news();
    changed.notify_all();
    wake.signal();
  }

  // Waits, at most until the source is stopped; true then.
  bool pause(milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex);
    return changed.wait_for(lock, time, [&] { return stopping; });
  }

  // The body of the thread. No exception leaves it: that would end the app.
  void run(std::shared_ptr<Camera> camera) noexcept {
    try {
      stream(camera);
    } catch (...) {
      fail_by(current_failure());
    }
    show(nullptr);
    if (camera != nullptr) camera->close();
    camera.reset();
    std::lock_guard<std::mutex> lock(mutex);
    ended = true;
    changed.notify_all();
  }

  void fail_by(const Failure& exception) noexcept {
    const bool is_memory = exception.status == MAQ_ERROR_OUT_OF_MEMORY;
    std::string reason = "out of memory";  // short, so that there is memory for it
    try {
      reason = concatenate(name, " stopped: ", is_memory ? "there is not enough memory" : exception.text);
    } catch (const std::exception&) {
    }
    {
      std::lock_guard<std::mutex> lock(mutex);
      if (is_memory) failure_status = MAQ_ERROR_OUT_OF_MEMORY;
    }
    fail(std::move(reason));
  }

  void fail(std::string reason) {
    std::lock_guard<std::mutex> lock(mutex);
    failure = std::move(reason);
    show_news();
    changed.notify_all();
  }

  // Most often the image was truncated on its way, and the next one is whole.
  void drop_jpeg(const CameraBuffer& buffer) {
    add_drops(1);
    if (std::exchange(warned_of_bad_jpeg, true)) return;
    settings.log.write(MAQ_LOG_WARNING, name, ": a JPEG image is damaged, or larger than the ", buffer.image.width_px,
                       " x ", buffer.image.height_px, " pixels agreed on; it is dropped, and so are others like it.");
  }

  // Waits at the end for a seek; false when the source is stopped instead.
  bool wait_at_end() {
    std::unique_lock<std::mutex> lock(mutex);
    at_end = true;
    show_news();
    changed.notify_all();
    changed.wait(lock, [&] { return stopping || !at_end; });
    return !stopping;
  }

  // Runs until the source is stopped or a lost camera stays away; `camera` is null then.
  void stream(std::shared_ptr<Camera>& camera) {
    uint64_t next_sequence = 0;  // continues when the camera is opened again
    uint32_t last_number = 0;    // the device's own
    bool is_first = true;        // first frame since the camera was opened
    int64_t last_time_ns = INT64_MIN;
    auto last_frame = Clock::now();
    bool stalled = false;
    const int wait_ms = std::min(kMaxWaitMs, settings.stall_ms);
    report(MAQ_SOURCE_STARTED, "started");
    for (;;) {
      CameraBuffer buffer;
      std::string reason;
      const Camera::Event event = camera->wait(wake.get(), wait_ms, buffer, reason);
      if (event == Camera::Event::kWoken || is_stopping()) {
        if (event == Camera::Event::kFrame) camera->give_back(buffer.slot);
        break;
      }
      if (event == Camera::Event::kFrame && !is_first && buffer.timestamp_ns < last_time_ns &&
          int32_t(buffer.sequence - last_number) < 0) {
        // A frame that comes after its successor, as uvcvideo shows some under load: it was counted as lost by then.
        camera->give_back(buffer.slot);
      } else if (event == Camera::Event::kFrame) {
        const uint32_t lost_before = is_first ? 0 : buffer.sequence - last_number - 1;
        // A number that repeats, goes back or leaps says nothing of frames that were lost.
        const uint64_t sequence = next_sequence + (lost_before < kMaxLostAtOnce ? lost_before : 0);
        add_drops(sequence - next_sequence);
        next_sequence = sequence + 1;
        last_number = buffer.sequence;
        is_first = false;
        last_frame = Clock::now();
        if (stalled) report(MAQ_SOURCE_RECONNECTED, "frames come again");
        stalled = false;
        PixelLease lease(camera, buffer.slot);
        if (buffer.damaged || buffer.timestamp_ns <= last_time_ns) {
          add_drops(1);
        } else {
          last_time_ns = buffer.timestamp_ns;
          push({std::move(lease), buffer, sequence});
        }
      } else if (event == Camera::Event::kTimeout) {
        if (!stalled && Clock::now() - last_frame >= milliseconds(settings.stall_ms)) {
          stalled = true;
          report(MAQ_SOURCE_STALLED, concatenate("no frame for ", settings.stall_ms, " ms"));
        }
      } else if (event == Camera::Event::kEnd) {
        if (!wait_at_end()) break;
        last_frame = Clock::now();
      } else {
        show(nullptr);
        camera->close();
        // As long as anything of it is mapped, the device keeps its number, and comes back under another.
        camera.reset();
        drop_waiting_frames();
        report(MAQ_SOURCE_LOST, reason);
        camera = reconnect();
        if (camera == nullptr) break;
        is_first = true;
        last_frame = Clock::now();
        stalled = false;
      }
    }
  }

  // Drops the frames that wait.
  void drop_waiting_frames() {
    std::vector<Entry> left;  // returned to the camera after the lock is released
    {
      std::lock_guard<std::mutex> lock(mutex);
      left.resize(ring.size());
      left.swap(ring);
      dropped += count;
      first = count = 0;
      show_news();
    }
  }

  void add_drops(uint64_t more) {
    std::lock_guard<std::mutex> lock(mutex);
    dropped += more;
  }

  // The camera again, or null when it did not come back in time or the source is stopped.
  std::shared_ptr<Camera> reconnect() {
    const auto deadline = Clock::now() + milliseconds(settings.reconnect_ms);
    std::string reason = "the device is not connected";
    if (settings.reconnect_ms > 0) report(MAQ_SOURCE_RECONNECTING, "waiting for the device to come back");
    while (Clock::now() < deadline) {
      if (pause(kReconnectPause)) return nullptr;
      try {
        std::shared_ptr<Camera> camera = open();
        restore_controls(*camera);
        show(camera);
        report(MAQ_SOURCE_RECONNECTED, "the device is back");
        return camera;
      } catch (const std::exception& error) {
        reason = error.what();
      }
    }
    fail(concatenate(name, " was lost and did not come back within ", settings.reconnect_ms, " ms: ", reason));
    return nullptr;
  }
};

LiveSource::LiveSource(CameraOpener open, std::string name, const SourceSettings& settings,
                       const std::vector<ControlSetting>& controls, const CalibrationOptions& calibration)
    : state_(std::make_shared<State>()) {
  state_->open = std::move(open);
  state_->name = std::move(name);
  state_->settings = settings;
  state_->ring.resize(std::max<size_t>(1, settings.queue_length));
  std::shared_ptr<Camera> camera = state_->open();
  for (const ControlSetting& setting : controls) camera->set_control(setting.which, setting.value);
  state_->set_controls = controls;
  state_->present = camera;
  const CameraFormat& format = camera->format();
  info_.width_px = format.width_px;
  info_.height_px = format.height_px;
  info_.fps = format.fps;
  info_.is_live = true;
  info_.clock = MAQ_CLOCK_MONOTONIC;
  intrinsics_ = calibration.intrinsics(format.width_px, format.height_px);
  if (!intrinsics_ && camera->intrinsics() != nullptr) intrinsics_ = *camera->intrinsics();
  state_->thread = start_thread(
      "maq source", [state = state_, camera = std::move(camera)]() mutable { state->run(std::move(camera)); });
}

LiveSource::~LiveSource() {
  State& state = *state_;
  state.stop();
  state.wait_for_report();
  std::vector<State::Entry> left;
  bool ended = false;
  {
    std::unique_lock<std::mutex> lock(state.mutex);
    ended = state.changed.wait_for(lock, kStopTimeout, [&] { return state.ended; });
    left.swap(state.ring);
    state.first = state.count = 0;
  }
  if (ended) {
    state.thread.join();
  } else {
    state.thread.detach();  // it hangs in the device, keeps the state alive, and ends when the device answers
  }
}

uint64_t LiveSource::drops() const {
  std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->dropped;
}

maq_source_control_info LiveSource::control(maq_source_control which) {
  std::lock_guard<std::mutex> lock(state_->control_mutex);
  return state_->present_camera()->control(which);
}

void LiveSource::set_control(maq_source_control which, double value) {
  std::lock_guard<std::mutex> lock(state_->control_mutex);
  const std::shared_ptr<Camera> camera = state_->present_camera();
  camera->set_control(which, value);
  if (!state_->remember(camera, {which, value})) {
    throw Error(MAQ_ERROR_DEVICE_LOST, state_->name, " was lost while a control was set; set it again.");
  }
}

void LiveSource::seek(int64_t time_ns) {
  std::lock_guard<std::mutex> lock(state_->control_mutex);
  state_->present_camera()->seek(time_ns);
  std::lock_guard<std::mutex> state_lock(state_->mutex);
  ++state_->seeks;
  state_->at_end = false;
  state_->show_news();
  state_->changed.notify_all();
}

void LiveSource::stop() { state_->stop(); }

void LiveSource::wait_for_report() { state_->wait_for_report(); }

int LiveSource::event_fd() {
  std::lock_guard<std::mutex> lock(state_->mutex);
  if (!state_->news) state_->news.emplace();
  state_->show_news();
  return state_->news->get();
}

NextFrame LiveSource::read(int64_t timeout_ns, Frame& frame) {
  const bool has_end = timeout_ns >= 0;
  const auto deadline = deadline_after(timeout_ns);
  for (;;) {
    State::Entry entry;
    uint32_t seeks = 0;
    {
      std::unique_lock<std::mutex> lock(state_->mutex);
      const auto ready = [&] { return state_->is_ready(); };
      if (!has_end) {
        state_->changed.wait(lock, ready);
      } else if (!state_->changed.wait_until(lock, deadline, ready)) {
        return NextFrame::kTimeout;
      }
      if (state_->stopping) return NextFrame::kStopped;
      if (state_->count == 0 && state_->at_end) return NextFrame::kEnd;
      if (state_->count == 0) throw Error(state_->failure_status, *state_->failure, ".");
      entry = std::move(state_->ring[state_->first]);
      state_->first = (state_->first + 1) % state_->ring.size();
      --state_->count;
      state_->show_news();
      seeks = state_->seeks;
    }
    const CameraBuffer& buffer = entry.buffer;
    if (buffer.seeks != seeks) continue;
    if (buffer.image.format == MAQ_PIXEL_DEPTH16 && buffer.depth_unit_m != kMillimetre) {
      uint8_t* metres = frame.allocate(MAQ_PIXEL_DEPTH32F, buffer.image.width_px, buffer.image.height_px);
      depth_in_metres(buffer.image, buffer.depth_unit_m, reinterpret_cast<float*>(metres));
      entry.lease.reset();
    } else if (buffer.jpeg == nullptr) {
      frame.image = buffer.image;
    } else if (!state_->jpeg.decode(buffer.jpeg, buffer.jpeg_bytes, max_jpeg_pixels(buffer.image), frame)) {
      state_->drop_jpeg(buffer);
      continue;
    }
    frame.jpeg = buffer.jpeg;
    frame.jpeg_bytes = buffer.jpeg_bytes;
    frame.depth = buffer.depth;
    frame.lease = std::move(entry.lease);
    frame.timestamp_ns = buffer.timestamp_ns;
    frame.clock = MAQ_CLOCK_MONOTONIC;
    frame.sequence = entry.sequence;
    frame.origin = buffer.origin.moved_to(frame.timestamp_ns, frame.sequence);
    return NextFrame::kFrame;
  }
}

}  // namespace maq
