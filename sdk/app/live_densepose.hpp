// Dense pose of a live source on a thread of its own, for apps with a window: a camera that hangs, a file that is read or
// a model that loads never holds up the thread that draws. For C++17, in this header alone.
//
//   maquette::Newest<Shown> newest;
//   maquette::LiveDensePose live(context, config, [&](const maquette::LiveFrame& mapped) {
//     newest.back().take_over(mapped);     // on the live thread: copy what is to be shown
//     newest.publish();
//   });
//   live.open("camera:");
//   for (;;) { if (newest.take()) draw(newest.front()); show(live.status().problem); }
#ifndef MAQUETTE_LIVE_HPP_
#define MAQUETTE_LIVE_HPP_

#if defined(__linux__)
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/triple_buffer.hpp"
#include "maquette/maquette.hpp"

namespace maquette {

inline double monotonic_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// So that drawing goes first; threads that this one starts inherit it. Of Linux; elsewhere nothing happens.
inline void lower_priority_of_this_thread() {
#if defined(__linux__)
  const id_t thread = id_t(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, std::min(19, getpriority(PRIO_PROCESS, thread) + 5));
#endif
}

// A frame and what was found in it, during a call of `mapped`. The result may be kept.
struct LiveFrame {
  const Frame& frame;
  std::shared_ptr<DensePoseResult> result;
  double waiting_ms;  // for the frame
  double age_ms;      // of a camera's frame now; -1 where it is not known
  double fps;         // of mapped frames, over the last second
  uint64_t number;    // of mapped frames, from 1
};

struct LiveStatus {
  std::string uri;      // what plays, with the options that were added
  std::string doing;    // "Opening v4l2:/dev/video0"; "" when frames come or nothing is to be done
  std::string problem;  // why no frames come, or what could not be done; a sentence
  bool ended = false;   // no more frames: a photo, the end of a clip, most_frames, or `failed`
  bool failed = false;
  uint64_t drops = 0;
  std::vector<std::string> events;  // of the camera: "started", "stalled", "lost", "reconnecting", "back"
};

struct LiveOptions {
  bool in_real_time = true;  // clips and stubs play at their pace and begin anew; else as fast as they are mapped
  uint64_t most_frames = 0;  // 0: no end
  int32_t reconnect_ms = 86400000;  // how long a lost camera is waited for
  int32_t largest_side_px = 2048;   // larger pictures of files are made smaller
  int32_t frames_held = 6;          // by the source's pool, and results by the model's
};

class LiveDensePose {
 public:
  // `mapped` is called on the live thread with each frame, `changed`, which may be null, on any with each change of
  // status. Neither may throw or destroy this. The context must outlive it.
  LiveDensePose(const Context& context, const maq_densepose_config& config,
                std::function<void(const LiveFrame&)> mapped, std::function<void()> changed = nullptr,
                const LiveOptions& options = {})
      : context_(context), options_(options), mapped_(std::move(mapped)), changed_(std::move(changed)) {
    set(config);
    thread_ = std::thread([this] { run(); });
  }
  // Waits until the step that runs is done: a model's run, or the opening of a device.
  ~LiveDensePose() {
    order([](Orders& orders) { orders.stop = true; });
    thread_.join();
  }
  LiveDensePose(const LiveDensePose&) = delete;
  LiveDensePose& operator=(const LiveDensePose&) = delete;

  // These return at once; what goes wrong is in status().

  // The URI of a source, in place of what plays. `otherwise`: what plays when it cannot be opened; its reason stays in
  // `problem`.
  void open(const std::string& uri, const std::string& otherwise = "") {
    order([&](Orders& orders) { orders.uri = uri, orders.otherwise = otherwise, ++orders.source_number; });
  }
  // Loads the model with other settings; a photo that is shown is mapped again.
  void set(const maq_densepose_config& config) {
    order([&](Orders& orders) {
      orders.config = config;
      orders.bundle = config.bundle_path == nullptr ? "" : config.bundle_path;
      ++orders.model_number;
    });
  }
  void pause(bool paused) {
    order([&](Orders& orders) { orders.paused = paused; });
  }
  // Begins a recording of the source's frames (.maqrec), or ends it with "".
  void record(const std::string& path) {
    order([&](Orders& orders) { orders.recording = path, ++orders.recording_number; });
  }

  LiveStatus status() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return status_;
  }
  // Points [24][nodes][nodes][3] as in maq_densepose_surface, once a model is loaded that has them; until then none.
  std::vector<float> surface(int* nodes) const {
    std::lock_guard<std::mutex> lock(mutex_);
    *nodes = surface_nodes_;
    return surface_;
  }

 private:
  struct Orders {
    std::string uri, otherwise, bundle, recording;
    maq_densepose_config config{};
    uint64_t source_number = 0, model_number = 0, recording_number = 0;
    bool paused = false, stop = false;
  };

  void order(const std::function<void(Orders&)>& change) {
    std::lock_guard<std::mutex> lock(mutex_);
    change(orders_);
    ++order_number_;
    wake_.notify_one();
  }

  template <class Change>
  void change_status(Change change) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      change(status_);
    }
    if (changed_) changed_();
  }

  void run() {
    lower_priority_of_this_thread();
    bool idle = false;
    uint64_t heard = 0;
    for (;;) {
      Orders orders;
      {
        std::unique_lock<std::mutex> lock(mutex_);
        if (idle) wake_.wait(lock, [&] { return order_number_ != heard; });
        orders = orders_;
        heard = order_number_;
      }
      try {
        if (orders.stop) return end_recording();
        idle = !step(orders);
      } catch (const std::exception& error) {
        if (orders.stop) return;  // nobody asks any more
        idle = true;
        source_.reset();
        change_status([&](LiveStatus& status) {
          status.doing.clear();
          status.problem = error.what();
          status.ended = status.failed = true;
        });
      }
    }
  }

  // False when there is nothing to do until the next order.
  bool step(const Orders& orders) {
    if (orders.source_number == 0) return false;  // nor is a model loaded for nothing
    if (source_number_ != orders.source_number) {
      source_number_ = orders.source_number;
      open_source(orders);
    }
    if (model_number_ != orders.model_number) {
      load_model(orders);  // again with the next order if it fails
      model_number_ = orders.model_number;
      if (held_ && !orders.paused) map(*held_, 0, -1);
    }
    if (!source_ || !model_ || orders.paused || has_all_frames()) return false;
    const double before_s = monotonic_s();
    std::optional<Frame> frame;
    try {
      frame = source_->next(kTurnNs);
    } catch (const Error& error) {
      if (error.status() == MAQ_TIMEOUT) return true;
      throw;
    }
    if (!frame) {
      end_recording();
      source_.reset();
      change_status([](LiveStatus& status) { status.ended = true; });
      return false;
    }
    keep_recording(orders, *frame);
    const maq_source_info info = source_->info();
    const double age_ms = info.is_live != 0 && info.clock == MAQ_CLOCK_MONOTONIC
                              ? monotonic_s() * 1000 - double(frame->desc().timestamp_ns) * 1e-6
                              : -1;
    held_.reset();
    map(*frame, (monotonic_s() - before_s) * 1000, age_ms);
    held_ = std::move(frame);
    change_status([&](LiveStatus& status) {
      status.drops = info.dropped_frame_count;
      status.ended = has_all_frames();
    });
    return true;
  }

  bool has_all_frames() const { return options_.most_frames != 0 && frames_ >= options_.most_frames; }

  void open_source(const Orders& orders) {
    source_.reset();
    held_.reset();
    end_recording();
    change_status([&](LiveStatus& status) {
      status = LiveStatus();
      status.uri = orders.uri;
      status.doing = "Opening " + orders.uri;
    });
    std::string uri = orders.uri, problem;
    try {
      open_in_shape(&uri);
    } catch (const std::exception& error) {
      if (orders.otherwise.empty()) throw;
      problem = error.what();
      uri = orders.otherwise;
      open_in_shape(&uri);
    }
    if (model_) model_->restart();
    change_status([&](LiveStatus& status) {
      status.uri = uri;
      status.doing.clear();
      if (!problem.empty()) status.problem = problem;
    });
  }

  // What a file is like is known when it is open; then it is opened once more as it is to be played.
  void open_in_shape(std::string* uri) {
    source_.emplace(opened(*uri));
    const maq_source_info info = source_->info();
    const double shrink = double(std::max(info.width_px, info.height_px)) / options_.largest_side_px;
    std::string more;
    if (shrink > 1 && info.is_live == 0) {
      more += "&size=" + std::to_string(std::max(1, int(info.width_px / shrink))) + "x" +
              std::to_string(std::max(1, int(info.height_px / shrink)));
    }
    if (options_.in_real_time && info.is_live == 0 && info.fps > 0 && uri->find("live=") == std::string::npos)
      more += "&live=1&loop=1";
    if (more.empty()) return;
    if (uri->find('?') == std::string::npos) more[0] = '?';
    source_.reset();
    source_.emplace(opened(*uri += more));
  }

  Source opened(const std::string& uri) {
    maq_source_config config = default_source_config();
    config.frame_pool_size = uint32_t(options_.frames_held);
    config.reconnect_ms = options_.reconnect_ms;
    config.state_user_data = this;
    config.state_callback = [](void* self, maq_source_state state, const char* reason) {
      static const char* const names[] = {"", "started", "stalled", "lost", "reconnecting", "back"};
      const bool known = state >= MAQ_SOURCE_STARTED && state <= MAQ_SOURCE_RECONNECTED;
      const std::string name = known ? names[state] : "changed";
      static_cast<LiveDensePose*>(self)->change_status([&](LiveStatus& status) {
        if (status.events.size() < kMostEvents) status.events.push_back(name);
        // What was said when it was opened stays when it starts.
        if (state == MAQ_SOURCE_RECONNECTED) status.problem.clear();
        if (state != MAQ_SOURCE_RECONNECTED && state != MAQ_SOURCE_STARTED) {
          status.problem = "The camera is " + name + ": " + reason;
        }
      });
    };
    return Source(context_, uri, &config);
  }

  void load_model(const Orders& orders) {
    change_status([](LiveStatus& status) { status.doing = "Loading the model"; });
    maq_densepose_config config = orders.config;
    config.bundle_path = orders.bundle.c_str();
    config.result_pool_size = uint32_t(options_.frames_held);
    model_.reset();
    model_.emplace(context_, config);
    const std::optional<maq_densepose_surface> surface = model_->surface();
    change_status([&](LiveStatus& status) {
      status.doing.clear();
      if (!surface) return;
      surface_nodes_ = surface->nodes;
      const size_t count = size_t(24 * 3) * size_t(surface->nodes) * size_t(surface->nodes);
      surface_.assign(surface->points_m, surface->points_m + count);
    });
  }

  // A disk that is full ends the recording, not the picture.
  void keep_recording(const Orders& orders, const Frame& frame) {
    try {
      if (recording_number_ != orders.recording_number) {
        recording_number_ = orders.recording_number;
        end_recording();
        if (!orders.recording.empty()) recorder_.emplace(context_, orders.recording, &*source_);
      }
      if (recorder_) recorder_->add(frame);
    } catch (const Error& error) {
      recorder_.reset();
      change_status([&](LiveStatus& status) { status.problem = error.what(); });
    }
  }

  void end_recording() {
    if (recorder_) recorder_->finish();
    recorder_.reset();
  }

  void map(const Frame& frame, double waiting_ms, double age_ms) {
    const double before_s = monotonic_s();
    auto result = std::make_shared<DensePoseResult>(model_->run(frame));
    const double now_s = monotonic_s();
    times_s_.push_back(now_s);
    while (now_s - times_s_.front() > 1) times_s_.pop_front();
    const double fps = times_s_.size() < 2 ? 0 : double(times_s_.size() - 1) / (now_s - times_s_.front());
    if (age_ms >= 0) age_ms += (now_s - before_s) * 1000;
    mapped_(LiveFrame{frame, std::move(result), waiting_ms, age_ms, fps, ++frames_});
  }

  static constexpr size_t kMostEvents = 1000;
  static constexpr int64_t kTurnNs = 100000000;  // how long a wait for a frame may hold up an order

  const Context& context_;
  const LiveOptions options_;
  const std::function<void(const LiveFrame&)> mapped_;
  const std::function<void()> changed_;

  mutable std::mutex mutex_;  // of what follows to the next line
  std::condition_variable wake_;
  Orders orders_;
  uint64_t order_number_ = 0;
  LiveStatus status_;
  std::vector<float> surface_;
  int surface_nodes_ = 0;

  // Of the live thread. The source's callback uses what is above.
  std::optional<Source> source_;
  std::optional<DensePose> model_;
  std::optional<Recorder> recorder_;
  std::optional<Frame> held_;  // mapped last, to be mapped with other settings
  uint64_t source_number_ = 0, model_number_ = 0, recording_number_ = 0, frames_ = 0;
  std::deque<double> times_s_;
  std::thread thread_;
};

}  // namespace maquette

#endif  // MAQUETTE_LIVE_HPP_
