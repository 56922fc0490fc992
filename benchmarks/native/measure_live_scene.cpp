// Measures the wait of an app with a window for a live scene (benchmarks/ui_latency.py).
//
//   measure_live_scene SCENE_BUNDLE SCENE_OR_CAPTURE
//
// prints {"open_ms": …, "first_view_ms": …, "longest_call_ms": …}: from open() until the app is told that the scene is
// ready, from open() until the first view of 640 x 480, and the longest call of the window's thread.
#include <app/fly_camera.h>
#include <app/live_scene.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <memory>
#include <mutex>
#include <stdexcept>

namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Wakes the window's thread, as an app's event loop does.
class Wake {
 public:
  void signal() {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_signalled_ = true;
    condition_.notify_one();
  }
  void wait() {
    std::unique_lock<std::mutex> lock(mutex_);
    condition_.wait(lock, [this] { return is_signalled_; });
    is_signalled_ = false;
  }

 private:
  std::mutex mutex_;
  std::condition_variable condition_;
  bool is_signalled_ = false;
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("arguments: SCENE_BUNDLE SCENE_OR_CAPTURE");
  Wake wake;
  const maquette::Context context;
  maquette::LiveScene scene(context, argv[1], 0, [&] { wake.signal(); });
  double longest_call_ms = 0;
  const auto timed = [&](auto call) {
    const Clock::time_point before = Clock::now();
    call();
    longest_call_ms = std::max(longest_call_ms, ms_since(before));
  };

  const Clock::time_point start = Clock::now();
  timed([&] { scene.open(argv[2]); });
  std::shared_ptr<const maquette::LiveSceneState> state;
  for (;;) {
    timed([&] { state = scene.state(); });
    if (state->phase == maquette::LiveSceneState::kReady) break;
    if (state->phase == maquette::LiveSceneState::kFailed) throw std::runtime_error(state->text);
    wake.wait();
  }
  const double open_ms = ms_since(start);
  const maquette::FlyCamera camera(state->info, {});
  timed([&] { scene.render(camera.camera(640, 480), -1); });
  bool has_image = false;
  for (;;) {
    timed([&] { has_image = scene.images().take(); });
    if (has_image) break;
    timed([&] { state = scene.state(); });
    if (state->phase == maquette::LiveSceneState::kFailed) throw std::runtime_error(state->text);
    wake.wait();
  }
  const double first_view_ms = ms_since(start);
  timed([&] { scene.close(); });
  std::printf("{\"open_ms\": %.3f, \"first_view_ms\": %.3f, \"longest_call_ms\": %.3f}\n", open_ms, first_view_ms,
              longest_call_ms);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "measure_live_scene: %s\n", error.what());
  return 1;
}
