// A head that one thread fits to photos and another renders, for programs with a window. The head can be turned while
// it is fitted. Only the destructor waits.
//
//   maquette::LiveHead head(context, "models/heads-int8");
//   head.fit({image, box_px}, 3.0, false);
//   for (;;) { head.render(view); if (head.images().take()) draw(head.images().front().rendering); }
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <maquette/maquette.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/mapped_frame.h"
#include "app/rgba_image.h"
#include "app/triple_buffer.h"

namespace maquette {

struct LiveHeadPhoto {
  RgbaImage image;
  std::optional<std::array<float, 4>> box_px;  // of the head, as in maq_head_photo; nothing: it is detected
};

// The frame with the largest head in it; nothing before the first frame.
std::optional<LiveHeadPhoto> head_photo_of(const MappedFrame& frame);

struct LiveHeadView {
  int width_px = 640, height_px = 480;  // at most; over the photo the image has the photo's shape
  double yaw_rad = 0, pitch_rad = 0;    // of the camera: to the person's left, up
  double zoom = 1;                      // above 1 the head is larger
  maq_head_shading shading = MAQ_HEAD_SHADING_COLOUR;
  bool is_over_photo = false;  // drawn on the photo, by the photo's camera; if that is unknown, by yaw and pitch
};

struct LiveHeadImage {
  RgbaImage rendering, photo;  // photo: the latest, of the rendering's size; empty unless that is over the photo
  double rendering_ms = 0;
  uint64_t number = 0;  // counts images from 1
};

struct LiveHeadState {
  enum Phase { kNone, kFitting, kReady, kFailed } phase = kNone;
  double progress = 0;                             // 0 to 1, while it is fitted
  std::string text;                                // the stage, or why it failed, in sentences; may be empty
  bool has_head = false;                           // there is a head to render
  std::shared_ptr<const RgbaImage> photo;          // the latest photo
  uint32_t photo_count = 0, used_photo_count = 0;  // from here on: of the head that is ready
  uint32_t triangle_count = 0;
  double pupil_distance_m = 0;  // 0: not known
  double seconds = 0;           // from the photo to the mesh
};

struct FittedHead {
  std::shared_ptr<const Head> head;
  HeadMesh mesh;
};

class LiveHead {  // all calls by the thread that takes the images
 public:
  // `threads`: 0 for the library's default. `on_change`, which may be null, is called on this object's threads after
  // each image and each change of state; it may not throw. The context must outlive this.
  LiveHead(const Context& context, const std::string& bundle_path, int threads = 0,
           std::function<void()> on_change = nullptr);
  ~LiveHead();  // waits for the step that runs

  // Fits a head to a photo, for `seconds`; `adds_photo`: together with the earlier photos. A running fit is cancelled.
  void fit(LiveHeadPhoto photo, double seconds, bool adds_photo);
  // Ends the fit; the latest preview of the head stays.
  void cancel() { is_cancelled_ = true; }
  // Renders an image once there is a preview of a head, and again for each later preview; the latest call wins.
  void render(const LiveHeadView& view);

  std::shared_ptr<const LiveHeadState> state() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return state_;
  }
  // The fitted head, or null.
  std::shared_ptr<const FittedHead> fitted() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return fitted_;
  }
  TripleBuffer<LiveHeadImage>& images() { return images_; }
  const TripleBuffer<LiveHeadImage>& images() const { return images_; }

 private:
  struct Request {
    LiveHeadPhoto photo;
    double seconds = 0;
    bool adds_photo = false;
  };
  // For the thread that renders, once it is set.
  struct Shown {
    HeadRenderer renderer;
    std::optional<maq_pinhole_camera> photo_camera;
    std::shared_ptr<const RgbaImage> photo;
  };

  void run_fits();
  void fit_photo(const Request& request);
  void run_renderings();
  void render_shown(Shown& shown, const LiveHeadView& view, LiveHeadImage& image);
  static int32_t tell_progress(void* live_head, double done, const char* stage);
  void show(const Head& head, const HeadMesh& mesh, bool has_photo_camera);
  void update(const std::function<void(LiveHeadState&)>& change) noexcept;

  const Context& context_;
  const std::string bundle_path_;
  const int threads_;
  const std::function<void()> on_change_;
  mutable std::mutex mutex_;  // guards the shared members
  std::condition_variable wake_fits_, wake_renderings_;
  std::optional<Request> request_;
  std::atomic<bool> is_cancelled_{false};  // the fit that runs
  bool ends_ = false;
  std::shared_ptr<const LiveHeadState> state_ = std::make_shared<LiveHeadState>();
  std::shared_ptr<const FittedHead> fitted_;
  std::shared_ptr<Shown> shown_;
  std::optional<LiveHeadView> view_;
  bool needs_image_ = false;
  TripleBuffer<LiveHeadImage> images_;
  uint64_t image_count_ = 0;                // of the thread that renders
  std::optional<HeadBuilder> builder_;      // of the thread that fits
  std::shared_ptr<const RgbaImage> photo_;  // the latest; of the thread that fits
  std::thread fits_, renderings_;
};

}  // namespace maquette
