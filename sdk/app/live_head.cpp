#include "app/live_head.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <utility>

#include "app/thread_priority.h"

namespace maquette {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPreviewInterval_s = 0.4, kPreviewCell_m = 0.004;
constexpr int kMaxSide_px = 4096;
constexpr uint32_t kTexture_px = 1024;  // saved heads and meshes then hold the photo's pixels
constexpr std::array<uint8_t, 3> kBackground = {18, 18, 20};

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string text_of(const std::exception& error) {
  return dynamic_cast<const std::bad_alloc*>(&error) != nullptr ? "There is not enough memory for it." : error.what();
}

double pupil_distance_m(const Head& head) {
  maq_head_landmark left{}, right{};
  left.struct_size = right.struct_size = sizeof left;
  if (maq_head_get_landmark(head.get(), "pupil_left", &left) != MAQ_OK) return 0;
  if (maq_head_get_landmark(head.get(), "pupil_right", &right) != MAQ_OK) return 0;
  return std::hypot(left.point_m[0] - right.point_m[0], left.point_m[1] - right.point_m[1],
                    left.point_m[2] - right.point_m[2]);
}

// The camera with an image that fits into that size.
maq_pinhole_camera fitted_into(maq_pinhole_camera camera, int width_px, int height_px) {
  maq_intrinsics& lens = camera.intrinsics;
  const double scale = std::min(double(width_px) / lens.width_px, double(height_px) / lens.height_px);
  lens.width_px = std::max(1, int(std::lround(lens.width_px * scale)));
  lens.height_px = std::max(1, int(std::lround(lens.height_px * scale)));
  lens.fx_px *= scale, lens.fy_px *= scale;
  lens.cx_px = (lens.cx_px + 0.5) * scale - 0.5, lens.cy_px = (lens.cy_px + 0.5) * scale - 0.5;
  return camera;
}

// Composes the image over `behind`, which has its size, or over a plain background.
void compose(const Image& image, const RgbaImage& behind, RgbaImage& to) {
  size_t bgr_stride = 0, alpha_stride = 0;
  const auto* const bgr = static_cast<const uint8_t*>(image.plane(MAQ_IMAGE_PLANE_BGR, &bgr_stride));
  const auto* const alpha = static_cast<const uint8_t*>(image.plane(MAQ_IMAGE_PLANE_ALPHA, &alpha_stride));
  for (int y = 0; y < to.height_px; ++y) {
    for (int x = 0; x < to.width_px; ++x) {
      const size_t at = 4 * (size_t(y) * size_t(to.width_px) + size_t(x));
      const uint8_t* const colour = bgr + size_t(y) * bgr_stride + 3 * size_t(x);
      const int share = alpha[size_t(y) * alpha_stride + size_t(x)];
      for (size_t c = 0; c < 3; ++c) {
        const int under = behind.empty() ? kBackground[c] : behind.rgba[at + c];
        to.rgba[at + c] = uint8_t((colour[2 - c] * share + under * (255 - share) + 127) / 255);
      }
      to.rgba[at + 3] = 255;
    }
  }
}

}  // namespace

std::optional<LiveHeadPhoto> head_photo_of(const MappedFrame& frame) {
  if (frame.number == 0) return std::nullopt;
  LiveHeadPhoto photo{frame.camera, {}};
  const auto area = [](const std::array<float, 4>& box) { return (box[2] - box[0]) * (box[3] - box[1]); };
  for (uint32_t i = 0; i < frame.people.size(); ++i) {
    const auto box = frame.result->head_box_px(i);
    if (box && (!photo.box_px || area(*box) > area(*photo.box_px))) photo.box_px = box;
  }
  return photo;
}

LiveHead::LiveHead(const Context& context, const std::string& bundle_path, int threads, std::function<void()> on_change)
    : context_(context), bundle_path_(bundle_path), threads_(threads), on_change_(std::move(on_change)) {
  fits_ = std::thread([this] { run_fits(); });
  renderings_ = std::thread([this] { run_renderings(); });
}

LiveHead::~LiveHead() {
  is_cancelled_ = true;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  wake_fits_.notify_one();
  wake_renderings_.notify_one();
  fits_.join();
  renderings_.join();
}

void LiveHead::fit(LiveHeadPhoto photo, double seconds, bool adds_photo) {
  const std::lock_guard<std::mutex> lock(mutex_);
  auto state = std::make_shared<LiveHeadState>(*state_);
  state->phase = LiveHeadState::kFitting, state->progress = 0, state->text = "Encoding the photo.";
  state_ = std::move(state);
  request_ = Request{std::move(photo), seconds, adds_photo};
  is_cancelled_ = true;  // the running fit, until the thread takes the request
  wake_fits_.notify_one();
}

void LiveHead::render(const LiveHeadView& view) {
  const std::lock_guard<std::mutex> lock(mutex_);
  view_ = view;
  view_->width_px = std::clamp(view.width_px, 1, kMaxSide_px);
  view_->height_px = std::clamp(view.height_px, 1, kMaxSide_px);
  needs_image_ = true;
  wake_renderings_.notify_one();
}

// Not while another fit is asked for, whose state it is then.
void LiveHead::update(const std::function<void(LiveHeadState&)>& change) noexcept try {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (request_ || ends_) return;
    auto state = std::make_shared<LiveHeadState>(*state_);
    change(*state);
    state_ = std::move(state);
  }
  if (on_change_) on_change_();
} catch (const std::bad_alloc&) {
}

void LiveHead::run_fits() {
  lower_priority_of_this_thread();
  while (true) {
    std::unique_lock<std::mutex> lock(mutex_);
    wake_fits_.wait(lock, [&] { return ends_ || request_; });
    if (ends_) return;
    const Request request = *std::exchange(request_, std::nullopt);
    is_cancelled_ = false;
    lock.unlock();
    try {
      fit_photo(request);
    } catch (const std::exception& error) {
      const std::string text = text_of(error);
      update([&](LiveHeadState& state) {
        state.phase = state.has_head ? LiveHeadState::kReady : LiveHeadState::kFailed;
        state.text = text;
      });
    }
  }
}

void LiveHead::fit_photo(const Request& request) {
  const auto start = Clock::now();
  if (!builder_) {
    maq_head_builder_config config = default_head_builder_config();
    config.model.bundle_path = bundle_path_.c_str(), config.model.threads = threads_;
    config.texture_px = kTexture_px;
    config.progress_callback = tell_progress;
    config.progress_user_data = this;
    builder_.emplace(context_, config);
  }
  photo_ = std::make_shared<const RgbaImage>(request.photo.image);
  update([&](LiveHeadState& state) { state.photo = photo_; });
  maq_head_photo known = default_head_photo();
  if (request.photo.box_px) std::copy(request.photo.box_px->begin(), request.photo.box_px->end(), known.box_px);
  if (!request.adds_photo) builder_->clear();
  builder_->add_photo(photo_->as_frame(context_), known);
  const uint32_t index = builder_->stats().photo_count - 1;

  std::shared_ptr<const Head> latest;  // of the previews
  builder_->set_preview(kPreviewInterval_s, [&](Head preview) {
    try {
      if (is_cancelled_) return;
      latest = std::make_shared<const Head>(std::move(preview));
      maq_head_mesh_config coarse = default_head_mesh_config();
      coarse.cell_m = kPreviewCell_m;
      show(*latest, HeadMesh(*latest, coarse), !request.adds_photo);
    } catch (const std::exception&) {  // the head itself may still be fine
    }
  });
  update([](LiveHeadState& state) { state.text = "Fitting the head to the photo."; });
  std::string text;
  std::shared_ptr<const Head> fitted;
  try {
    fitted = std::make_shared<const Head>(builder_->fit(request.seconds));
  } catch (const Error& error) {
    builder_->set_preview(0, nullptr);
    if (error.status() != MAQ_CANCELLED || latest == nullptr) throw;
    fitted = latest;
    text = "Cancelled: the head as far as it was fitted.";
  }
  builder_->set_preview(0, nullptr);
  const bool is_used = builder_->photo(index).is_used != 0;
  if (!is_used && text.empty()) text = "The photo was rejected: it shows no head, or a different person.";
  update([](LiveHeadState& state) { state.text = "Making the mesh."; });
  const auto ready = std::make_shared<const FittedHead>(FittedHead{fitted, HeadMesh(*fitted)});
  show(*fitted, ready->mesh, is_used);
  const maq_head_build_stats stats = builder_->stats();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    fitted_ = ready;
  }
  update([&](LiveHeadState& state) {
    state.phase = LiveHeadState::kReady, state.progress = 1, state.text = text;
    state.photo_count = stats.photo_count, state.used_photo_count = stats.used_photo_count;
    state.triangle_count = ready->mesh.data().triangle_count, state.pupil_distance_m = pupil_distance_m(*fitted);
    state.seconds = seconds_since(start);
  });
}

int32_t LiveHead::tell_progress(void* live_head, double done, const char*) {
  auto* const self = static_cast<LiveHead*>(live_head);
  self->update([&](LiveHeadState& state) { state.progress = done; });
  return self->is_cancelled_ ? 0 : 1;
}

// The last camera belongs to the latest photo.
void LiveHead::show(const Head& head, const HeadMesh& mesh, bool has_photo_camera) {
  maq_head_renderer_config config = default_head_renderer_config();
  config.threads = threads_;
  Shown made{HeadRenderer(context_, config, mesh), {}, photo_};
  const uint32_t cameras = head.info().photo_count;
  if (has_photo_camera && cameras > 0) made.photo_camera = head.camera(cameras - 1);
  auto shown = std::make_shared<Shown>(std::move(made));
  {
    // One step, so that no image comes while the state says that there is no head.
    const std::lock_guard<std::mutex> lock(mutex_);
    auto state = std::make_shared<LiveHeadState>(*state_);
    state->has_head = true;
    state_ = std::move(state);
    shown_ = std::move(shown);
    needs_image_ = view_.has_value();
    wake_renderings_.notify_one();
  }
  if (on_change_) on_change_();
}

void LiveHead::run_renderings() {
  lower_priority_of_this_thread();
  while (true) {
    std::unique_lock<std::mutex> lock(mutex_);
    wake_renderings_.wait(lock, [&] { return ends_ || (needs_image_ && view_ && shown_); });
    if (ends_) return;
    needs_image_ = false;
    const LiveHeadView view = *view_;
    const std::shared_ptr<Shown> shown = shown_;
    lock.unlock();
    try {
      const auto start = Clock::now();
      LiveHeadImage& image = images_.back();
      render_shown(*shown, view, image);
      image.rendering_ms = 1e3 * seconds_since(start);
      image.number = ++image_count_;
      images_.publish();
      if (on_change_) on_change_();
    } catch (const std::exception& error) {
      const std::string text = text_of(error);
      update([&](LiveHeadState& state) { state.text = text; });
    }
  }
}

void LiveHead::render_shown(Shown& shown, const LiveHeadView& view, LiveHeadImage& image) {
  shown.renderer.set_shading(view.shading);
  const bool is_over_photo = view.is_over_photo && shown.photo_camera;
  maq_pinhole_camera camera = is_over_photo
                                  ? fitted_into(*shown.photo_camera, view.width_px, view.height_px)
                                  : shown.renderer.camera(view.yaw_rad, view.pitch_rad, view.width_px, view.height_px);
  if (!is_over_photo) camera.intrinsics.fx_px *= view.zoom, camera.intrinsics.fy_px *= view.zoom;
  const int width = camera.intrinsics.width_px, height = camera.intrinsics.height_px;
  image.photo.clear();
  if (is_over_photo) image.photo.copy_from(shown.photo->as_frame(context_).resized(width, height));
  image.rendering.resize(width, height);
  compose(shown.renderer.run(camera), image.photo, image.rendering);
}

}  // namespace maquette
