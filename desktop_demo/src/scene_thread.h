// Opens scenes, builds them of captures and renders them, on a thread of its own: no call waits for it but the destructor.
#pragma once

#include <condition_variable>
#include <functional>
#include <maquette/maquette.hpp>
#include <thread>
#include <vector>

#include "newest.h"
#include "picture.h"

struct SceneShown {
  Picture rendering, photo, error;  // photo and error (mean of the channels) are empty unless the camera is a photo's;
  double psnr_db = 0;               // this is NaN then, and infinite where nothing differs
  int photo_index = -1;
  maq_camera camera{};  // of the rendering's size
  maq_scene_image_stats stats{};
  uint64_t number = 0;  // counts pictures from 1
};

struct SceneState {
  enum What { kNothing, kOpening, kReady, kFailed } what = kNothing;
  double done = 0;         // 0 to 1, while opening
  std::string path, text;  // text: what is being done, what is missing or why it failed, in sentences; or nothing
  maq_scene_info info{};   // from here on: once it is ready
  std::vector<maq_camera> photos;
  std::vector<std::string> photo_names;  // with " (kept out)" where the capture keeps them for comparisons
};

class SceneThread {  // all calls by the thread that takes the pictures
 public:
  SceneThread(const std::string& bundle_path, int threads);  // 0 threads: the library's default
  ~SceneThread();                                            // waits for the step that runs
  // In place of what was open, of which no picture comes any more: a scene file, with the photos of `capture_folder` unless
  // that is empty; or a capture, which is built.
  void open(const std::string& path, const std::string& capture_folder = {});
  void close() { open({}); }
  // Renders a picture once there is a scene, 1280 x 960 at most; the latest call wins. `photo_index`: whose camera, or -1.
  void look(const maq_camera& camera, int photo_index);
  void set_threads(int threads);  // renders the latest picture again
  std::shared_ptr<const SceneState> state() const { return std::atomic_load(&state_); }
  Newest<SceneShown>& shown() { return shown_; }

 private:
  struct Wish {
    std::string path, capture_folder;
    int threads = 0, photo_index = -1;
    std::optional<maq_camera> camera;
    bool opens = false, draws = false, ends = false;
  };
  void run();
  void load(const Wish& wish);
  void make_renderer(int threads);
  void draw(const Wish& wish);
  bool update(const std::function<void(SceneState&)>& change) noexcept;

  const std::string bundle_path_;
  std::mutex mutex_;  // of the wish, and of changes of the state
  std::condition_variable wake_;
  Wish wish_;
  std::shared_ptr<const SceneState> state_ = std::make_shared<SceneState>();
  Newest<SceneShown> shown_;
  // Of the thread alone:
  std::optional<maquette::Context> context_;
  std::optional<maquette::Capture> capture_;
  std::optional<maquette::Scene> scene_;
  std::optional<maquette::SceneRenderer> renderer_;
  std::string missing_;  // the state's text while nothing fails
  Picture photo_;        // the latest, and its index and size
  std::array<int, 3> photo_key_{};
  int threads_ = 0;
  uint64_t pictures_ = 0;
  std::thread thread_;
};
