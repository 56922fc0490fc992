#include "sources/synthetic/stub_source.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "sources/synthetic/depth_noise.h"
#include "sources/synthetic/solids_rays.h"
#include "sources/synthetic/solids_scene.h"
#include "sources/synthetic/stub_people.h"

namespace maq {
namespace {

constexpr double kDefaultFps = 30;
constexpr double kMaxLengthS = 1e9;  // nanoseconds of it fit

// Seven bars of 75 % intensity in the usual order, moving to the left, above a grey ramp.
void draw_pattern(int64_t index, double fps, Frame& frame) {
  constexpr uint8_t kBars[7][3] = {{191, 191, 191}, {0, 191, 191}, {191, 191, 0}, {0, 191, 0},
                                   {191, 0, 191},   {0, 0, 191},   {191, 0, 0}};  // B, G, R
  const int width = frame.image.width_px;
  const int height = frame.image.height_px;
  const int shift_px = int(std::fmod(double(index) / fps * 0.1 * width, double(width)));
  uint8_t* pixel = frame.storage.data();
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, pixel += 3) {
      const int at = (x + shift_px) % width;
      const uint8_t ramp = uint8_t(at * 256 / width);
      const uint8_t* bar = kBars[at * 7 / width];
      for (int c = 0; c < 3; ++c) pixel[c] = y < height - height / 5 ? bar[c] : ramp;
    }
  }
}

// Solids of known size, seen by a depth camera that moves around them.
class StubSolids {
 public:
  // Throws MAQ_ERROR_INVALID_ARGUMENT for a scene or noise that there is not.
  StubSolids(const std::string& scene, const std::string& noise, uint64_t seed, int width_px, int height_px)
      : scene_(make_solids_scene(scene, seed)), noise_(noise, seed), picture_{width_px, height_px} {
    intrinsics_.width_px = width_px;
    intrinsics_.height_px = height_px;
    intrinsics_.fx_px = intrinsics_.fy_px = picture_.focal_px();
    intrinsics_.cx_px = picture_.centre_x_px();
    intrinsics_.cy_px = picture_.centre_y_px();
  }

  const maq_intrinsics& intrinsics() const { return intrinsics_; }

  void draw(uint64_t index, double time_s, Frame& frame) {
    auto* metres = reinterpret_cast<float*>(frame.allocate(MAQ_PIXEL_DEPTH32F, picture_.width_px, picture_.height_px));
    rays_.look(scene_, solids_view(scene_, time_s));
    rays_.draw(picture_, metres);
    noise_.apply(picture_, index, metres);
  }

 private:
  SolidsScene scene_;
  SolidsRays rays_;
  DepthNoise noise_;
  SolidsPicture picture_;
  maq_intrinsics intrinsics_{};
};

uint64_t take_seed(SourceUri& uri) { return uint64_t(uri.take_integer("seed", 1, 0, INT64_MAX)); }

class StubSource : public Source {
 public:
  explicit StubSource(SourceUri uri) {
    const bool shows_people = uri.target == "people", shows_solids = uri.target == "solids";
    if (!shows_people && !shows_solids && uri.target != "pattern") {
      throw Error(MAQ_ERROR_UNSUPPORTED, "stub:", uri.target,
                  " is not known; there are stub:people, stub:pattern and stub:solids.");
    }
    info_.width_px = uri.width_px > 0 ? uri.width_px : shows_solids ? 320 : 640;
    info_.height_px = uri.height_px > 0 ? uri.height_px : shows_solids ? 240 : 480;
    info_.fps = uri.fps > 0 ? uri.fps : kDefaultFps;
    max_frames_ = int64_t(kMaxLengthS * info_.fps);
    info_.frame_count = uri.take_integer("frames", -1, 1, max_frames_);
    if (shows_solids) {
      const uint64_t seed = take_seed(uri);
      const std::string scene = uri.take_text("scene"), noise = uri.take_text("noise");
      uri.expect_no_more_options("scene, noise, seed, frames, size and fps");
      solids_ = std::make_unique<StubSolids>(scene.empty() ? "box" : scene, noise.empty() ? "none" : noise, seed,
                                             info_.width_px, info_.height_px);
    } else if (shows_people) {
      const int count = int(uri.take_integer("count", 2, 0, 30));
      const uint64_t seed = take_seed(uri);
      uri.expect_no_more_options("count, seed, frames, size and fps");
      people_ = std::make_unique<StubPeople>(count, seed, info_.width_px, info_.height_px);
    } else {
      uri.expect_no_more_options("frames, size and fps");
    }
  }

  const SourceInfo& info() const override { return info_; }
  const maq_intrinsics* intrinsics() const override { return solids_ == nullptr ? nullptr : &solids_->intrinsics(); }

  bool can_seek() const override { return true; }
  void seek(int64_t time_ns) override {
    const double index = std::ceil(double(time_ns) / 1e9 * info_.fps - 1e-6);
    index_ = int64_t(std::min(index, double(info_.frame_count < 0 ? max_frames_ : info_.frame_count)));
  }

 private:
  NextFrame read(int64_t, Frame& frame) override {
    if (index_ == info_.frame_count) return NextFrame::kEnd;
    const double time_s = double(index_) / info_.fps;
    if (solids_ != nullptr) {
      solids_->draw(uint64_t(index_), time_s, frame);
    } else if (people_ != nullptr) {
      frame.allocate_bgr(info_.width_px, info_.height_px);
      people_->draw(time_s, frame);
    } else {
      frame.allocate_bgr(info_.width_px, info_.height_px);
      draw_pattern(index_, info_.fps, frame);
    }
    frame.timestamp_ns = int64_t(std::llround(double(index_) * 1e9 / info_.fps));
    frame.clock = MAQ_CLOCK_MEDIA;
    frame.sequence = uint64_t(index_);
    ++index_;
    return NextFrame::kFrame;
  }

  SourceInfo info_;
  std::unique_ptr<StubPeople> people_;
  std::unique_ptr<StubSolids> solids_;
  int64_t max_frames_ = 0;
  int64_t index_ = 0;
};

}  // namespace

std::unique_ptr<Source> open_stub_source(SourceUri uri) { return std::make_unique<StubSource>(std::move(uri)); }

}  // namespace maq
