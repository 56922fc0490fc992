#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/file.h"
#include "image/convert.h"
#include "image/files/file_codecs.h"
#include "image/geometry/resize.h"
#include "sources/files/file_sources.h"

namespace maq {
namespace {

class VideoSource : public Source {
 public:
  explicit VideoSource(SourceUri uri) : path_(uri.target), asked_fps_(uri.fps) {
    uri.expect_no_more_options("size and fps");
    if (!file_exists(path_)) throw Error(MAQ_ERROR_NOT_FOUND, path_, " does not exist; check the path.");
    clip_ = file_codecs().open_clip(path_);
    if (clip_ == nullptr) {
      throw Error(MAQ_ERROR_UNREADABLE, path_, " cannot be opened as a video: it is truncated, damaged or no video. ",
                  "Use a whole MP4, AVI, MOV or WebM file.");
    }
    const int width = clip_->width_px();
    const int height = clip_->height_px();
    check_image_size(width, height, path_);
    info_.width_px = uri.width_px > 0 ? uri.width_px : width;
    info_.height_px = uri.height_px > 0 ? uri.height_px : height;

    clip_fps_ = clip_->fps();
    if (!std::isfinite(clip_fps_) || clip_fps_ <= 0 || clip_fps_ > 1000) clip_fps_ = 25;
    const bool thinned = asked_fps_ > 0 && asked_fps_ < clip_fps_;
    info_.fps = thinned ? asked_fps_ : clip_fps_;

    const double count = clip_->frame_count();
    if (std::isfinite(count) && count >= 1 && count < 1e9) {
      promised_frames_ = int64_t(count);
      info_.frame_count = thinned ? int64_t(std::ceil(count * asked_fps_ / clip_fps_)) : promised_frames_;
    }
  }

  const SourceInfo& info() const override { return info_; }

  NextFrame next(int64_t, Frame& frame) override {
    while (read()) {
      const int64_t index = frames_read_++;
      const int64_t timestamp_ns = presentation_time_ns(index);
      if (asked_fps_ > 0) {
        if (timestamp_ns < next_due_ns_) continue;
        // Due times lie on a fixed grid, so that the rate does not drift.
        const double period_ns = 1e9 / asked_fps_;
        next_due_ns_ = int64_t((std::floor(double(timestamp_ns) / period_ns + 1e-3) + 1) * period_ns) - 500000;
      }
      deliver(frame, timestamp_ns, index);
      return NextFrame::kFrame;
    }
    return NextFrame::kEnd;
  }

 private:
  bool read() {
    if (ended_) return false;
    ended_ = !clip_->read(decoded_);
    if (!ended_) return true;
    if (frames_read_ == 0) {
      throw Error(MAQ_ERROR_UNREADABLE, path_, " has no frame that can be decoded: it is truncated or damaged.");
    }
    // Headers of clips with a varying frame rate give the count only roughly, so a few frames less are no defect.
    if (promised_frames_ > frames_read_ + 2 + promised_frames_ / 20) {
      throw Error(MAQ_ERROR_UNREADABLE, path_, " ends after ", frames_read_, " of ", promised_frames_,
                  " frames: the file is truncated or damaged; copy it again.");
    }
    return false;
  }

  // Containers without times report 0 for every frame; there the frame rate counts. Never runs backwards.
  int64_t presentation_time_ns(int64_t index) {
    const double reported_ms = clip_->position_ms();
    int64_t time_ns = std::isfinite(reported_ms) && reported_ms > 0
                          ? int64_t(std::llround(reported_ms * 1e6))
                          : int64_t(std::llround(double(index) * 1e9 / clip_fps_));
    time_ns = std::max(time_ns, last_time_ns_ + 1);
    last_time_ns_ = time_ns;
    return time_ns;
  }

  void deliver(Frame& frame, int64_t timestamp_ns, int64_t index) {
    if (decoded_.planes[0].data == nullptr) {
      throw Error(MAQ_ERROR_UNREADABLE, path_, " has frames of an unusual format; convert it to 8-bit video.");
    }
    check_image_size(decoded_.width_px, decoded_.height_px, path_);
    if (decoded_.width_px != info_.width_px || decoded_.height_px != info_.height_px) {
      resize_to_bgr(decoded_, info_.width_px, info_.height_px, frame);
    } else {
      uint8_t* pixels = frame.allocate_bgr(decoded_.width_px, decoded_.height_px);
      copy_pixels(decoded_, MAQ_PIXEL_BGR8, pixels, 0, frame.storage.size());
    }
    frame.timestamp_ns = timestamp_ns;
    frame.clock = MAQ_CLOCK_MEDIA;
    frame.sequence = uint64_t(index);
  }

  std::string path_;
  std::unique_ptr<ClipDecoder> clip_;
  ImageView decoded_;  // the decoder's memory
  SourceInfo info_;
  double clip_fps_ = 0;
  double asked_fps_ = 0;
  int64_t promised_frames_ = -1;
  int64_t frames_read_ = 0;
  int64_t last_time_ns_ = -1;
  int64_t next_due_ns_ = 0;
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<Source> open_video_source(SourceUri uri) { return std::make_unique<VideoSource>(std::move(uri)); }

}  // namespace maq
