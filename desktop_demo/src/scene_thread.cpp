#include "scene_thread.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace {

maq_camera within_limits(maq_camera camera) {
  const double scale = std::min(1280.0 / camera.width_px, 960.0 / camera.height_px);
  if (!(scale > 0 && scale < 1)) return camera;
  camera.width_px = std::max(1, int(camera.width_px * scale + 0.5));
  camera.height_px = std::max(1, int(camera.height_px * scale + 0.5));
  camera.fx_px *= scale, camera.fy_px *= scale;
  camera.cx_px = (camera.cx_px + 0.5) * scale - 0.5, camera.cy_px = (camera.cy_px + 0.5) * scale - 0.5;
  return camera;
}

Picture copy(const maquette::Frame& frame) {
  Picture picture;
  picture.resize(frame.desc().width_px, frame.desc().height_px);
  frame.copy_pixels(MAQ_PIXEL_RGBA8, picture.rgba.data(), 0, picture.rgba.size());
  return picture;
}

// Each pixel is the mean of places all over it, less than one of the photo's pixels apart.
Picture resized(Picture from, int width_px, int height_px) {
  if (from.width_px == width_px && from.height_px == height_px) return from;
  Picture to;
  to.resize(width_px, height_px);
  const double width = double(from.width_px) / width_px, height = double(from.height_px) / height_px;
  const int side = 1 + int(std::ceil(std::max(width, height)));
  for (size_t i = 0; i < to.rgba.size(); ++i) {
    int sum = 0;
    for (int place = 0; place < side * side; ++place) {
      const size_t x = size_t((double(i / 4 % size_t(width_px)) + (place % side + 0.5) / side) * width);
      const size_t y = size_t((double(i / 4 / size_t(width_px)) + (place / side + 0.5) / side) * height);
      sum += from.rgba[(y * size_t(from.width_px) + x) * 4 + i % 4];
    }
    to.rgba[i] = uint8_t(sum / (side * side));
  }
  return to;
}

// Black, red, yellow, white for differences from 0 to 128. Returns the PSNR.
double compare(const Picture& one, const Picture& other, Picture& error) {
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

}  // namespace

SceneThread::SceneThread(const std::string& bundle_path, int threads) : bundle_path_(bundle_path) {
  wish_.threads = threads;
  thread_ = std::thread([this] { run(); });
}

SceneThread::~SceneThread() {
  std::unique_lock<std::mutex> lock(mutex_);
  wish_.ends = true;
  wake_.notify_one();
  lock.unlock();
  thread_.join();
}

void SceneThread::open(const std::string& path, const std::string& capture_folder) {
  auto state = std::make_shared<SceneState>();
  if (!path.empty()) *state = {SceneState::kOpening, 0, path, "Opening " + path + ".", {}, {}, {}};
  const std::lock_guard<std::mutex> lock(mutex_);
  wish_ = {path, capture_folder, wish_.threads, -1, {}, true, false, false};
  std::atomic_store(&state_, std::shared_ptr<const SceneState>(state));
  shown_.take();
  wake_.notify_one();
}

void SceneThread::look(const maq_camera& camera, int photo_index) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wish_.camera = camera, wish_.photo_index = photo_index, wish_.draws = true;
  wake_.notify_one();
}

void SceneThread::set_threads(int threads) {
  const std::lock_guard<std::mutex> lock(mutex_);
  wish_.draws |= wish_.camera && threads != wish_.threads;
  wish_.threads = threads;
  wake_.notify_one();
}

// False when the scene that it is about is no longer wanted.
bool SceneThread::update(const std::function<void(SceneState&)>& change) noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (wish_.opens || wish_.ends) return false;
  auto state = std::make_shared<SceneState>(*state_);
  change(*state);
  std::atomic_store(&state_, std::shared_ptr<const SceneState>(state));
  return true;
}

void SceneThread::run() {
  // The window's thread comes first on a busy machine; the networks' threads inherit this.
  if (getpriority(PRIO_PROCESS, 0) < 5) setpriority(PRIO_PROCESS, 0, 5);
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
      update([&](SceneState& state) {
        if (!renderer_) state.what = SceneState::kFailed;
        state.text = is_memory ? "There is not enough memory for it." : error.what();
      });
    }
  }
}

void SceneThread::load(const Wish& wish) {
  renderer_.reset(), scene_.reset(), capture_.reset();
  photo_key_ = {}, missing_.clear();
  if (wish.path.empty()) return;
  if (!context_) context_.emplace();
  std::error_code ignored;
  const bool builds = std::filesystem::is_directory(wish.path, ignored);
  try {
    const std::string& folder = builds ? wish.path : wish.capture_folder;
    if (!folder.empty()) capture_.emplace(*context_, folder);
  } catch (const maquette::Error& error) {
    if (builds) throw;
    missing_ = std::string("There are no photos to compare with: ") + error.what();
  }
  if (builds) {
    maq_scene_build_config config = maquette::default_scene_build_config();
    config.bundle_path = bundle_path_.c_str(), config.threads = wish.threads, config.progress_user_data = this;
    config.progress = [](void* self, double done, const char* what) -> int32_t {
      return static_cast<SceneThread*>(self)->update([&](SceneState& state) { state.done = done, state.text = what; });
    };
    scene_.emplace(*context_, config, *capture_);
  } else {
    scene_.emplace(*context_, wish.path);
  }
  make_renderer(wish.threads);
  SceneState ready{SceneState::kReady, 1, wish.path, missing_, scene_->info(), {}, {}};
  for (uint32_t i = 0; capture_ && i < capture_->info().view_count; ++i) {
    const maq_capture_view view = capture_->view(i);
    ready.photos.push_back(view.camera);
    ready.photo_names.push_back(std::string(view.name) + (view.held_out == 1 ? " (kept out)" : ""));
  }
  update([&](SceneState& state) { state = ready; });
}

void SceneThread::make_renderer(int threads) {
  threads_ = threads;
  maq_scene_renderer_config config = maquette::default_scene_renderer_config();
  config.bundle_path = bundle_path_.c_str(), config.threads = threads;
  renderer_ = maquette::SceneRenderer(*context_, config, *scene_);
}

void SceneThread::draw(const Wish& wish) {
  if (threads_ != wish.threads) make_renderer(wish.threads);
  const maq_camera camera = within_limits(*wish.camera);
  const maquette::SceneImage image = renderer_->run(camera);
  maq_frame_desc desc{sizeof desc, MAQ_PIXEL_BGR8, camera.width_px, camera.height_px, {}, {}, 0, MAQ_CLOCK_MEDIA, 0};
  desc.planes[0] = static_cast<const uint8_t*>(image.plane(MAQ_SCENE_BGR, desc.stride_bytes));
  SceneShown& shown = shown_.back();
  shown.rendering = copy(maquette::Frame(*context_, desc));
  shown.camera = camera, shown.stats = image.stats(), shown.photo_index = -1, shown.psnr_db = NAN;
  shown.photo.resize(0, 0), shown.error.resize(0, 0);
  std::string text = missing_;
  const std::array<int, 3> key{wish.photo_index, camera.width_px, camera.height_px};
  try {
    if (capture_ && wish.photo_index >= 0) {
      if (photo_key_ != key) photo_ = resized(copy(capture_->load_view(uint32_t(key[0]))), key[1], key[2]);
      photo_key_ = key;
      shown.photo = photo_;
      shown.psnr_db = compare(shown.rendering, photo_, shown.error);
      shown.photo_index = wish.photo_index;
    }
  } catch (const maquette::Error& error) {
    text = error.what();
  }
  if (state()->text != text) update([&](SceneState& state) { state.text = text; });
  const std::lock_guard<std::mutex> lock(mutex_);
  shown.number = ++pictures_;
  if (!wish_.opens) shown_.publish();
}
