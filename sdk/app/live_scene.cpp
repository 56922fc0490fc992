#include "app/live_scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <new>

#include "app/thread_priority.h"

namespace maquette {
namespace {

constexpr double kMaxWidthPx = 1280, kMaxHeightPx = 960;

maq_pinhole_camera within_limits(maq_pinhole_camera camera) {
  const double scale = std::min(kMaxWidthPx / camera.intrinsics.width_px, kMaxHeightPx / camera.intrinsics.height_px);
  if (!(scale > 0 && scale < 1)) return camera;
  camera.intrinsics.width_px = std::max(1, int(std::lround(camera.intrinsics.width_px * scale)));
  camera.intrinsics.height_px = std::max(1, int(std::lround(camera.intrinsics.height_px * scale)));
  camera.intrinsics.fx_px *= scale, camera.intrinsics.fy_px *= scale;
  camera.intrinsics.cx_px = (camera.intrinsics.cx_px + 0.5) * scale - 0.5,
  camera.intrinsics.cy_px = (camera.intrinsics.cy_px + 0.5) * scale - 0.5;
  return camera;
}

// Black, red, yellow, white for differences from 0 to 128. Returns the PSNR.
double compare(const RgbaImage& one, const RgbaImage& other, RgbaImage& error) {
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

LiveScene::LiveScene(const Context& context, const std::string& bundle_path, int threads,
                     std::function<void()> on_change)
    : context_(context), bundle_path_(bundle_path), threads_(threads), on_change_(std::move(on_change)) {
  thread_ = std::thread([this] { run(); });
}

LiveScene::~LiveScene() {
  std::unique_lock<std::mutex> lock(mutex_);
  request_.ends = true;
  wake_.notify_one();
  lock.unlock();
  thread_.join();
}

void LiveScene::open(const std::string& path, const std::string& capture_folder) {
  auto state = std::make_shared<LiveSceneState>();
  if (!path.empty()) *state = {LiveSceneState::kOpening, 0, path, "Opening " + path + ".", {}, {}, {}};
  const std::lock_guard<std::mutex> lock(mutex_);
  request_ = {path, capture_folder, -1, {}, true, false, false};
  state_ = std::move(state);
  images_.take();
  wake_.notify_one();
}

void LiveScene::render(const maq_pinhole_camera& camera, int photo_index) {
  const std::lock_guard<std::mutex> lock(mutex_);
  request_.camera = camera, request_.photo_index = photo_index, request_.renders = true;
  wake_.notify_one();
}

// False when the scene that it is about is no longer asked for.
bool LiveScene::update(const std::function<void(LiveSceneState&)>& change) noexcept try {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (request_.opens || request_.ends) return false;
    auto state = std::make_shared<LiveSceneState>(*state_);
    change(*state);
    state_ = std::move(state);
  }
  if (on_change_) on_change_();
  return true;
} catch (const std::bad_alloc&) {
  return false;
}

void LiveScene::run() {
  lower_priority_of_this_thread();
  while (true) {
    try {
      std::unique_lock<std::mutex> lock(mutex_);
      wake_.wait(lock, [&] { return request_.ends || request_.opens || (request_.renders && renderer_); });
      if (request_.ends) return;
      const Request request = request_;
      (request.opens ? request_.opens : request_.renders) = false;
      lock.unlock();
      request.opens ? load(request) : render(request);
    } catch (const std::exception& error) {
      const bool is_memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
      update([&](LiveSceneState& state) {
        if (!renderer_) state.phase = LiveSceneState::kFailed;
        state.text = is_memory ? "There is not enough memory for it." : error.what();
      });
    }
  }
}

void LiveScene::load(const Request& request) {
  renderer_.reset(), scene_.reset(), capture_.reset();
  photo_key_ = {}, missing_.clear();
  if (request.path.empty()) return;
  std::error_code ignored;
  const bool builds = std::filesystem::is_directory(request.path, ignored);
  try {
    const std::string& folder = builds ? request.path : request.capture_folder;
    if (!folder.empty()) capture_.emplace(context_, folder);
  } catch (const Error& error) {
    if (builds) throw;
    missing_ = std::string("There are no photos to compare with: ") + error.what();
  }
  if (builds) {
    maq_scene_build_config config = default_scene_build_config();
    config.model.bundle_path = bundle_path_.c_str(), config.model.threads = threads_;
    config.progress_user_data = this;
    config.progress_callback = [](void* self, double done, const char* stage) -> int32_t {
      return static_cast<LiveScene*>(self)->update(
          [&](LiveSceneState& state) { state.progress = done, state.text = stage; });
    };
    scene_.emplace(context_, config, *capture_);
  } else {
    scene_.emplace(context_, request.path);
  }
  make_renderer();
  LiveSceneState ready{LiveSceneState::kReady, 1, request.path, missing_, scene_->info(), {}, {}};
  for (uint32_t i = 0; capture_ && i < capture_->info().view_count; ++i) {
    const maq_capture_view view = capture_->view(i);
    ready.photos.push_back(view.camera);
    ready.photo_names.push_back(std::string(view.name) + (view.is_held_out == 1 ? " (held out)" : ""));
  }
  update([&](LiveSceneState& state) { state = ready; });
}

void LiveScene::make_renderer() {
  maq_scene_renderer_config config = default_scene_renderer_config();
  config.model.bundle_path = bundle_path_.c_str(), config.model.threads = threads_;
  renderer_ = SceneRenderer(context_, config, *scene_);
}

void LiveScene::render(const Request& request) {
  LiveSceneImage& image = images_.back();
  image.camera = within_limits(*request.camera);
  const Image rendered = renderer_->run(image.camera);
  maq_frame_desc desc{sizeof desc,
                      MAQ_PIXEL_BGR8,
                      image.camera.intrinsics.width_px,
                      image.camera.intrinsics.height_px,
                      {},
                      {},
                      0,
                      MAQ_CLOCK_MEDIA,
                      0,
                      image.camera.intrinsics};
  desc.planes[0] = static_cast<const uint8_t*>(rendered.plane(MAQ_IMAGE_PLANE_BGR, desc.stride_bytes));
  image.rendering.copy_from(Frame(context_, desc));
  image.stats = rendered.scene_stats(), image.photo_index = -1, image.psnr_db = NAN;
  image.photo.clear(), image.error.clear();
  std::string text = missing_;
  try {
    if (capture_ && request.photo_index >= 0) add_photo(request, image);
  } catch (const Error& error) {
    text = error.what();
  }
  if (state()->text != text) update([&](LiveSceneState& state) { state.text = text; });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    image.number = ++image_count_;
    if (!request_.opens) images_.publish();
  }
  if (on_change_) on_change_();
}

void LiveScene::add_photo(const Request& request, LiveSceneImage& image) {
  const std::array<int, 3> key{request.photo_index, image.camera.intrinsics.width_px,
                               image.camera.intrinsics.height_px};
  if (photo_key_ != key) {
    photo_key_ = {};
    photo_.copy_from(capture_->load_view(uint32_t(key[0])).resized(key[1], key[2]));
  }
  photo_key_ = key;
  image.photo = photo_;
  image.psnr_db = compare(image.rendering, photo_, image.error);
  image.photo_index = request.photo_index;
}

}  // namespace maquette
