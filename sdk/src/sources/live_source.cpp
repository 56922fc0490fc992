#include "sources/live_source.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <optional>
#include <thread>
#include <vector>

#include "core/error.h"
#include "image/jpeg.h"

namespace maq {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kReconnectPause(100);
constexpr milliseconds kStopPatience(40);  // of the 50 ms that closing may take
constexpr int kLongestWaitMs = 200;  // whether the camera stalls is looked at between two waits

}  // namespace

// What the source and its thread share. The thread may outlive the source, when the device hangs.
struct LiveSource::State {
  struct Entry {
    PixelLease lease;
    CameraBuffer buffer;
    uint64_t sequence = 0;
  };

  CameraOpener open;
  std::string name;
  SourceSettings settings;
  int wake_fd = -1;

  std::mutex mutex;
  std::condition_variable changed;
  // A ring of at most `capacity` frames: the newest pushes out the oldest.
  std::vector<Entry> ring;
  size_t first = 0, count = 0;
  uint64_t dropped = 0;
  std::optional<std::string> failure;
  bool at_end = false;  // after the frames that wait
  bool stopping = false;
  bool ended = false;  // the thread
  std::thread thread;
  JpegDecoder jpeg;  // of next() alone

  ~State() {
    if (wake_fd >= 0) ::close(wake_fd);
  }

  void report(maq_source_state state, const std::string& reason) {
    settings.log.write(state == MAQ_SOURCE_STARTED || state == MAQ_SOURCE_BACK ? MAQ_LOG_INFO : MAQ_LOG_WARNING, name,
                       ": ", reason);
    if (settings.on_state != nullptr && !stop_asked()) settings.on_state(settings.user_data, state, reason.c_str());
  }

  void push(Entry entry) {
    Entry old;  // given back after the lock is released
    {
      std::lock_guard<std::mutex> lock(mutex);
      if (count == ring.size()) {
        old = std::move(ring[first]);
        first = (first + 1) % ring.size();
        --count;
        ++dropped;
      }
      ring[(first + count) % ring.size()] = std::move(entry);
      ++count;
    }
    changed.notify_all();
  }

  bool stop_asked() {
    std::lock_guard<std::mutex> lock(mutex);
    return stopping;
  }

  // Waits, but not for longer than until somebody asks to stop. True if so.
  bool pause(milliseconds time) {
    std::unique_lock<std::mutex> lock(mutex);
    return changed.wait_for(lock, time, [&] { return stopping; });
  }

  // What the thread does. Nothing gets past it: an exception would end the app.
  void run(std::shared_ptr<Camera> camera) noexcept {
    try {
      stream(camera);
    } catch (const std::exception& error) {
      fail(concatenate(name, " stopped: ", error.what()));
    } catch (...) {
      fail(name + " stopped: its state callback threw an exception");
    }
    if (camera != nullptr) camera->close();
    camera.reset();
    std::lock_guard<std::mutex> lock(mutex);
    ended = true;
    changed.notify_all();
  }

  void fail(std::string reason) {
    std::lock_guard<std::mutex> lock(mutex);
    failure = std::move(reason);
    changed.notify_all();
  }

  void end_of_stream() {
    std::lock_guard<std::mutex> lock(mutex);
    at_end = true;
    changed.notify_all();
  }

  // Until somebody asks to stop, or the camera stays away; `camera` is null then.
  void stream(std::shared_ptr<Camera>& camera) {
    uint64_t base = 0, next_sequence = 0;  // sequence numbers go on where they were when the camera is opened anew
    uint32_t first_sequence = 0;
    bool is_first = true;  // of the camera as it was opened last
    auto last_frame = Clock::now();
    bool stalled = false;
    const int wait_ms = std::min(kLongestWaitMs, settings.stall_ms);
    report(MAQ_SOURCE_STARTED, "started");
    for (;;) {
      CameraBuffer buffer;
      std::string reason;
      const Camera::Event event = camera->wait(wake_fd, wait_ms, buffer, reason);
      if (event == Camera::Event::kWoken || stop_asked()) {
        if (event == Camera::Event::kFrame) camera->give_back(buffer.slot);
        break;
      }
      if (event == Camera::Event::kFrame) {
        if (is_first) first_sequence = buffer.sequence;
        is_first = false;
        const uint64_t sequence = base + uint32_t(buffer.sequence - first_sequence);
        if (sequence > next_sequence) add_drops(sequence - next_sequence);
        next_sequence = sequence + 1;
        last_frame = Clock::now();
        if (stalled) report(MAQ_SOURCE_BACK, "frames come again");
        stalled = false;
        PixelLease lease(camera, buffer.slot);
        if (buffer.damaged) {
          add_drops(1);
        } else {
          push({std::move(lease), buffer, sequence});
        }
      } else if (event == Camera::Event::kTimeout) {
        if (!stalled && Clock::now() - last_frame >= milliseconds(settings.stall_ms)) {
          stalled = true;
          report(MAQ_SOURCE_STALLED, concatenate("no frame for ", settings.stall_ms, " ms"));
        }
      } else if (event == Camera::Event::kEnd) {
        end_of_stream();
        break;
      } else {
        camera->close();
        // As long as anything of it is mapped, the device keeps its number, and comes back under another.
        camera.reset();
        forget_frames();
        report(MAQ_SOURCE_LOST, reason);
        camera = reconnect();
        if (camera == nullptr) break;
        base = next_sequence;
        is_first = true;
        last_frame = Clock::now();
        stalled = false;
      }
    }
  }

  // Those that nobody took.
  void forget_frames() {
    std::vector<Entry> left;  // given back after the lock is released
    {
      std::lock_guard<std::mutex> lock(mutex);
      left.resize(ring.size());
      left.swap(ring);
      dropped += count;
      first = count = 0;
    }
  }

  void add_drops(uint64_t more) {
    std::lock_guard<std::mutex> lock(mutex);
    dropped += more;
  }

  // The camera again, or null when it did not come back in time or the source is closed.
  std::shared_ptr<Camera> reconnect() {
    const auto deadline = Clock::now() + milliseconds(settings.reconnect_ms);
    std::string reason = "the device is gone";
    if (settings.reconnect_ms > 0) report(MAQ_SOURCE_RECONNECTING, "waiting for the device to come back");
    while (Clock::now() < deadline) {
      if (pause(kReconnectPause)) return nullptr;
      try {
        std::shared_ptr<Camera> camera = open();
        report(MAQ_SOURCE_BACK, "the device is back");
        return camera;
      } catch (const std::exception& error) {
        reason = error.what();
      }
    }
    fail(concatenate(name, " was lost and did not come back within ", settings.reconnect_ms, " ms: ", reason));
    return nullptr;
  }
};

LiveSource::LiveSource(CameraOpener open, std::string name, const SourceSettings& settings)
    : state_(std::make_shared<State>()) {
  state_->open = std::move(open);
  state_->name = std::move(name);
  state_->settings = settings;
  state_->ring.resize(std::max<size_t>(1, settings.queue_length));
  state_->wake_fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (state_->wake_fd < 0) throw Error(MAQ_ERROR_INTERNAL, state_->name, ": no event can be made to wake its thread.");
  std::shared_ptr<Camera> camera = state_->open();
  const CameraFormat& format = camera->format();
  info_.width_px = format.width_px;
  info_.height_px = format.height_px;
  info_.fps = format.fps;
  info_.is_live = true;
  info_.clock = MAQ_CLOCK_MONOTONIC;
  if (camera->calibration() != nullptr) calibration_ = *camera->calibration();
  state_->thread =
      std::thread([state = state_, camera = std::move(camera)]() mutable { state->run(std::move(camera)); });
}

LiveSource::~LiveSource() {
  State& state = *state_;
  std::vector<State::Entry> left;
  bool ended = false;
  {
    std::unique_lock<std::mutex> lock(state.mutex);
    state.stopping = true;
    state.changed.notify_all();
    const uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(state.wake_fd, &one, sizeof one);
    ended = state.changed.wait_for(lock, kStopPatience, [&] { return state.ended; });
    left.swap(state.ring);
    state.ring.resize(1);
    state.first = state.count = 0;
  }
  if (ended) {
    state.thread.join();
  } else {
    state.thread.detach();  // it hangs in the device, holds the state itself, and ends when the device answers
  }
}

uint64_t LiveSource::drops() const {
  std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->dropped;
}

NextFrame LiveSource::next(int64_t timeout_ns, Frame& frame) {
  const bool has_end = timeout_ns >= 0;
  const auto deadline = Clock::now() + std::chrono::nanoseconds(has_end ? timeout_ns : 0);
  for (;;) {
    State::Entry entry;
    {
      std::unique_lock<std::mutex> lock(state_->mutex);
      const auto ready = [&] { return state_->count > 0 || state_->failure || state_->at_end; };
      if (!has_end) {
        state_->changed.wait(lock, ready);
      } else if (!state_->changed.wait_until(lock, deadline, ready)) {
        return NextFrame::kTimeout;
      }
      if (state_->count == 0 && state_->at_end) return NextFrame::kEnd;
      if (state_->count == 0) throw Error(MAQ_ERROR_DEVICE_LOST, *state_->failure, ".");
      entry = std::move(state_->ring[state_->first]);
      state_->first = (state_->first + 1) % state_->ring.size();
      --state_->count;
    }
    const CameraBuffer& buffer = entry.buffer;
    if (buffer.jpeg == nullptr) {
      frame.image = buffer.image;
    } else if (!state_->jpeg.decode(buffer.jpeg, buffer.jpeg_bytes, frame)) {
      state_->add_drops(1);  // cut short on its way; the next one follows soon
      continue;
    }
    frame.jpeg = buffer.jpeg;
    frame.jpeg_bytes = buffer.jpeg_bytes;
    frame.depth = buffer.depth;
    frame.lease = std::move(entry.lease);
    frame.timestamp_ns = buffer.timestamp_ns;
    frame.clock = MAQ_CLOCK_MONOTONIC;
    frame.sequence = entry.sequence;
    return NextFrame::kFrame;
  }
}

}  // namespace maq
