// Scenes on a thread of their own, for apps with a window: opens them, builds them of captures, renders what is looked at.
// No call waits but the destructor's. For C++17, in this header alone.
//
//   maquette::LiveScene scene(context, "models/scenes-int8");
//   scene.open("room.maqs");
//   for (;;) { if (scene.shown().take()) draw(scene.shown().front().rendering); scene.look(flight.camera(w, h), -1); }
#ifndef MAQUETTE_LIVE_SCENE_HPP_
#define MAQUETTE_LIVE_SCENE_HPP_

#include <algorithm>
#include <array>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/live_densepose.hpp"
#include "app/rgba_image.hpp"

namespace maquette {

struct LiveScenePicture {
  Picture rendering, photo, error;  // photo and error (mean of the channels) are empty unless the camera is a photo's;
  double psnr_db = 0;               // this is NaN then, and infinite where nothing differs
  int photo_index = -1;
  maq_pinhole_camera camera{};  // of the rendering's size
  maq_scene_image_stats stats{};
  uint64_t number = 0;  // counts pictures from 1
};

struct LiveSceneState {
  enum What { kNothing, kOpening, kReady, kFailed } what = kNothing;
  double done = 0;         // 0 to 1, while opening
  std::string path, text;  // text: what is being done, what is missing or why it failed, in sentences; or nothing
  maq_scene_info info{};   // from here on: once it is ready
  std::vector<maq_pinhole_camera> photos;
  std::vector<std::string> photo_names;  // with " (kept out)" where the capture keeps them for comparisons
};

class LiveScene {  // all calls by the thread that takes the pictures
 public:
  // `threads`: 0 for the library's default. `changed`, which may be null, is called on the thread after each picture and each
  // change of state; it may not throw. The context must outlive this.
  LiveScene(const Context& context, const std::string& bundle_path, int threads = 0,
            std::function<void()> changed = nullptr);
  ~LiveScene();  // waits for the step that runs
  // In place of what was open, of which no picture comes any more: a scene file, with the photos of `capture_folder` unless
  // that is empty; or a capture, which is built.
  void open(const std::string& path, const std::string& capture_folder = {});
  void close() { open({}); }
  // Renders a picture once there is a scene, 1280 x 960 at most; the latest call wins. `photo_index`: whose camera, or -1.
  void look(const maq_pinhole_camera& camera, int photo_index);
  void set_threads(int threads);  // renders the latest picture again
  std::shared_ptr<const LiveSceneState> state() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return state_;
  }
  Newest<LiveScenePicture>& shown() { return shown_; }
  const Newest<LiveScenePicture>& shown() const { return shown_; }

 private:
  struct Wish {
    std::string path, capture_folder;
    int threads = 0, photo_index = -1;
    std::optional<maq_pinhole_camera> camera;
    bool opens = false, draws = false, ends = false;
  };
  static maq_pinhole_camera within_limits(maq_pinhole_camera camera) {
    const double scale = std::min(1280.0 / camera.width_px, 960.0 / camera.height_px);
    if (!(scale > 0 && scale < 1)) return camera;
    camera.width_px = std::max(1, int(std::lround(camera.width_px * scale)));
    camera.height_px = std::max(1, int(std::lround(camera.height_px * scale)));
    camera.fx_px *= scale, camera.fy_px *= scale;
    camera.cx_px = (camera.cx_px + 0.5) * scale - 0.5, camera.cy_px = (camera.cy_px + 0.5) * scale - 0.5;
    return camera;
  }

  // Each pixel is the mean of places all over it, less than one of the photo's pixels apart.
  static Picture resized(Picture from, int width_px, int height_px) {
    if (from.width_px == width_px && from.height_px == height_px) return from;
    Picture to;
    to.resize(width_px, height_px);
    const double width = double(from.width_px) / width_px, height = double(from.height_px) / height_px;
    const int side = 1 + int(std::ceil(std::max(width, height)));
    for (size_t i = 0; i < to.rgba.size(); ++i) {
      const size_t column = i / 4 % size_t(width_px), row = i / 4 / size_t(width_px);
      int sum = 0;
      for (int down = 0; down < side; ++down) {
        for (int right = 0; right < side; ++right) {
          const size_t x = size_t((double(column) + (right + 0.5) / side) * width);
          const size_t y = size_t((double(row) + (down + 0.5) / side) * height);
          sum += from.rgba[(y * size_t(from.width_px) + x) * 4 + i % 4];
        }
      }
      to.rgba[i] = uint8_t(sum / (side * side));
    }
    return to;
  }

  // Black, red, yellow, white for differences from 0 to 128. Returns the PSNR.
  static double compare(const Picture& one, const Picture& other, Picture& error) {
    error.resize(one.width_px, one.height_px);
    double squares = 0;
    for (size_t i = 0; i < error.rgba.size(); i += 4) {
      int sum = 0;
      for (size_t c = i; c < i + 3; ++c) {
        const int difference = std::abs(one.rgba[c] - other.rgba[c]);
        sum += difference, squares += difference * difference;
      }
      for (int c = 0; c < 3; ++c) error.rgba[i + size_t(c)] = uint8_t(std::clamp(sum * 255 / 128 - 255 * c, 0, 255));
      error.rgba[i + 3] = 255;
    }
    return 10 * std::log10(255 * 255 * 0.75 * double(error.rgba.size()) / squares);
  }

  void run();
  void load(const Wish& wish);
  void make_renderer(int threads);
  void draw(const Wish& wish);
  bool update(const std::function<void(LiveSceneState&)>& change) noexcept;

  const Context& context_;
  const std::string bundle_path_;
  const std::function<void()> changed_;
  mutable std::mutex mutex_;  // of the wish and the state
  std::condition_variable wake_;
  Wish wish_;
  std::shared_ptr<const LiveSceneState> state_ = std::make_shared<LiveSceneState>();
  Newest<LiveScenePicture> shown_;
  // Of the thread alone:
  std::optional<Capture> capture_;
  std::optional<Scene> scene_;
  std::optional<SceneRenderer> renderer_;
  std::string missing_;  // the state's text while nothing fails
  Picture photo_;        // the latest, and its index and size
  std::array<int, 3> photo_key_{};
  int threads_ = 0;
  uint64_t pictures_ = 0;
  std::thread thread_;
};

inline LiveScene::LiveScene(const Context& context, const std::string& bundle_path, int threads,
                            std::function<void()> changed)
    : context_(context), bundle_path_(bundle_path), changed_(std::move(changed)) {
  wish_.threads = threads;
  thread_ = std::thread([this] { run(); });
}

inline LiveScene::~LiveScene() {
  std::unique_lock<std::mutex> lock(mutex_);
  wish_.ends = true;
  wake_.notify_one();
  lock.unlock();
  thread_.join();
}

inline void LiveScene::open(const std::string& path, const std::string& capture_folder) {
  auto state = std::make_shared<LiveSceneState>();
  if (!path.empty()) *state = {LiveSceneState::kOpening, 0, path, "Opening " + path + ".", {}, {}, {}};
  const std::lock_guard<std::mutex> lock(mutex_);
  wish_ = {path, capture_folder, wish_.threads, -1, {}, true, false, false};
  state_ = std::move(state);
  shown_.take();
  wake_.notify_one();
}

inline void LiveScene::look(const maq_pinhole_camera& camera, int photo_index) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wish_.camera = camera, wish_.photo_index = photo_index, wish_.draws = true;
  wake_.notify_one();
}

inline void LiveScene::set_threads(int threads) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wish_.draws |= wish_.camera && threads != wish_.threads;
  wish_.threads = threads;
  wake_.notify_one();
}

// False when the scene that it is about is no longer wanted.
inline bool LiveScene::update(const std::function<void(LiveSceneState&)>& change) noexcept try {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (wish_.opens || wish_.ends) return false;
    auto state = std::make_shared<LiveSceneState>(*state_);
    change(*state);
    state_ = std::move(state);
  }
  if (changed_) changed_();
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

inline void LiveScene::run() {
  lower_priority_of_this_thread();
  while (true) {
    try {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [&] { return wish_.ends || wish_.opens || (wish_.draws && renderer_); });
      if (wish_.ends) return;
      const Wish wish = wish_;
      (wish.opens ? wish_.opens : wish_.draws) = false;
      lock.unlock();
      wish.opens ? load(wish) : draw(wish);
    } catch (const std::exception& error) {
      const bool is_memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
      update([&](LiveSceneState& state) {
        if (!renderer_) state.what = LiveSceneState::kFailed;
        state.text = is_memory ? "There is not enough memory for it." : error.what();
      });
    }
  }
}

inline void LiveScene::load(const Wish& wish) {
  renderer_.reset(), scene_.reset(), capture_.reset();
  photo_key_ = {}, missing_.clear();
  if (wish.path.empty()) return;
  std::error_code ignored;
  const bool builds = std::filesystem::is_directory(wish.path, ignored);
  try {
    const std::string& folder = builds ? wish.path : wish.capture_folder;
    if (!folder.empty()) capture_.emplace(context_, folder);
  } catch (const Error& error) {
    if (builds) throw;
    missing_ = std::string("There are no photos to compare with: ") + error.what();
  }
  if (builds) {
    maq_scene_build_config config = default_scene_build_config();
    config.bundle_path = bundle_path_.c_str(), config.threads = wish.threads, config.progress_user_data = this;
    config.progress_callback = [](void* self, double done, const char* what) -> int32_t {
      return static_cast<LiveScene*>(self)->update(
          [&](LiveSceneState& state) { state.done = done, state.text = what; });
    };
    scene_.emplace(context_, config, *capture_);
  } else {
    scene_.emplace(context_, wish.path);
  }
  make_renderer(wish.threads);
  LiveSceneState ready{LiveSceneState::kReady, 1, wish.path, missing_, scene_->info(), {}, {}};
  for (uint32_t i = 0; capture_ && i < capture_->info().view_count; ++i) {
    const maq_capture_view view = capture_->view(i);
    ready.photos.push_back(view.camera);
    ready.photo_names.push_back(std::string(view.name) + (view.is_held_out == 1 ? " (kept out)" : ""));
  }
  update([&](LiveSceneState& state) { state = ready; });
}

inline void LiveScene::make_renderer(int threads) {
  threads_ = threads;
  maq_scene_renderer_config config = default_scene_renderer_config();
  config.bundle_path = bundle_path_.c_str(), config.threads = threads;
  renderer_ = SceneRenderer(context_, config, *scene_);
}

inline void LiveScene::draw(const Wish& wish) {
  if (threads_ != wish.threads) make_renderer(wish.threads);
  const maq_pinhole_camera camera = within_limits(*wish.camera);
  const SceneImage image = renderer_->run(camera);
  maq_frame_desc desc{sizeof desc, MAQ_PIXEL_BGR8, camera.width_px, camera.height_px, {}, {}, 0, MAQ_CLOCK_MEDIA, 0};
  desc.planes[0] = static_cast<const uint8_t*>(image.plane(MAQ_SCENE_PLANE_BGR, desc.stride_bytes));
  LiveScenePicture& shown = shown_.back();
  shown.rendering.take(Frame(context_, desc));
  shown.camera = camera, shown.stats = image.stats(), shown.photo_index = -1, shown.psnr_db = NAN;
  shown.photo.resize(0, 0), shown.error.resize(0, 0);
  std::string text = missing_;
  const std::array<int, 3> key{wish.photo_index, camera.width_px, camera.height_px};
  try {
    if (capture_ && wish.photo_index >= 0) {
      if (photo_key_ != key) {
        photo_.take(capture_->load_view(uint32_t(key[0])));
        photo_ = resized(std::move(photo_), key[1], key[2]);
      }
      photo_key_ = key;
      shown.photo = photo_;
      shown.psnr_db = compare(shown.rendering, photo_, shown.error);
      shown.photo_index = wish.photo_index;
    }
  } catch (const Error& error) {
    text = error.what();
  }
  if (state()->text != text) update([&](LiveSceneState& state) { state.text = text; });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    shown.number = ++pictures_;
    if (!wish_.opens) shown_.publish();
  }
  if (changed_) changed_();
}

}  // namespace maquette

#endif  // MAQUETTE_LIVE_SCENE_HPP_
