// A scene on its own thread, for programs with a window: opens it or builds it from a capture, and renders it. Only the
// destructor waits.
//
//   maquette::LiveScene scene(context, "models/scenes-int8");
//   scene.open("room.maqs");
//   for (;;) { if (scene.images().take()) draw(scene.images().front().rendering); scene.render(fly.camera(w, h), -1); }
#pragma once

#include <array>
#include <condition_variable>
#include <functional>
#include <maquette/maquette.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/rgba_image.h"
#include "app/triple_buffer.h"

namespace maquette {

struct LiveSceneImage {
  // Photo and error (mean of the channels) are empty unless the camera is a photo's.
  RgbaImage rendering, photo, error;
  double psnr_db = 0;  // NaN where the photo is empty, infinite where nothing differs
  int photo_index = -1;
  maq_pinhole_camera camera{};  // of the rendering's size
  maq_scene_render_stats stats{};
  uint64_t number = 0;  // counts images from 1
};

struct LiveSceneState {
  enum Phase { kClosed, kOpening, kReady, kFailed } phase = kClosed;
  double progress = 0;  // 0 to 1, while opening
  std::string path,
      text;               // text: sentences: the current step, the missing parts or the reason of a failure; or nothing
  maq_scene_info info{};  // from here on: once it is ready
  std::vector<maq_pinhole_camera> photos;
  std::vector<std::string> photo_names;  // with " (held out)" where the capture keeps them for comparisons
};

class LiveScene {  // all calls by the thread that takes the images
 public:
  // `threads`: 0 for the library's default. `on_change`, which may be null, is called on the scene's thread after each
  // image and each change of state; it may not throw. The context must outlive this.
  LiveScene(const Context& context, const std::string& bundle_path, int threads = 0,
            std::function<void()> on_change = nullptr);
  ~LiveScene();  // waits for the step that runs
  // Opens, instead of the current scene, whose images end: a scene file, with the photos of `capture_folder` unless
  // that is empty; or a capture, which is built.
  void open(const std::string& path, const std::string& capture_folder = {});
  void close() { open({}); }
  // Renders an image once there is a scene, 1280 x 960 at most; the latest call wins. `photo_index`: whose camera, or
  // -1.
  void render(const maq_pinhole_camera& camera, int photo_index);
  std::shared_ptr<const LiveSceneState> state() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return state_;
  }
  TripleBuffer<LiveSceneImage>& images() { return images_; }
  const TripleBuffer<LiveSceneImage>& images() const { return images_; }

 private:
  struct Request {
    std::string path, capture_folder;
    int photo_index = -1;
    std::optional<maq_pinhole_camera> camera;
    bool opens = false, renders = false, ends = false;
  };

  void run();
  void load(const Request& request);
  void make_renderer();
  void render(const Request& request);
  void add_photo(const Request& request, LiveSceneImage& image);
  bool update(const std::function<void(LiveSceneState&)>& change) noexcept;

  const Context& context_;
  const std::string bundle_path_;
  const int threads_;
  const std::function<void()> on_change_;
  mutable std::mutex mutex_;  // of the request and the state
  std::condition_variable wake_;
  Request request_;
  std::shared_ptr<const LiveSceneState> state_ = std::make_shared<LiveSceneState>();
  TripleBuffer<LiveSceneImage> images_;
  // Used only by the thread:
  std::optional<Capture> capture_;
  std::optional<Scene> scene_;
  std::optional<SceneRenderer> renderer_;
  std::string missing_;  // the state's text while nothing fails
  RgbaImage photo_;      // the latest, and its index and size
  std::array<int, 3> photo_key_{};
  uint64_t image_count_ = 0;
  std::thread thread_;
};

}  // namespace maquette
