#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/files/file.h"
#include "image/clips/clip_reader.h"
#include "image/convert.h"
#include "image/geometry/resize.h"
#include "sources/files/file_sources.h"

namespace maq {
namespace {

constexpr double kMaxFrames = 1e9;
constexpr int64_t kRoundingNs = 2000;  // times of seeking are given in microseconds

class VideoSource : public Source {
 public:
  explicit VideoSource(SourceUri uri) : path_(uri.target), asked_fps_(uri.fps) {
    uri.expect_no_more_options("size and fps");
    open_file(path_);  // throws for a path that is not a file: decoders would wait for a pipe, and seek in it
    open(0);
    if (!clip_->has_frames()) {
      throw Error(MAQ_ERROR_UNREADABLE, path_, " cannot be opened as a video: it is truncated, damaged or no video. ",
                  "Use a whole MP4, AVI, MOV or WebM file.", answer_of_program());
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

    const double count = std::round(clip_->duration_s() * clip_fps_);
    if (count >= 1 && count < kMaxFrames) {
      promised_frames_ = int64_t(count);
      info_.frame_count = thinned ? int64_t(std::ceil(count * asked_fps_ / clip_fps_)) : promised_frames_;
    }
  }

  const SourceInfo& info() const override { return info_; }

  bool can_seek() const override { return true; }
  void seek(int64_t time_ns) override { seek_to_ns_ = time_ns; }

 private:
  NextFrame read(int64_t, Frame& frame) override {
    if (seek_to_ns_) {
      const int64_t time_ns = std::max<int64_t>(*std::exchange(seek_to_ns_, std::nullopt), 0);
      open(double(time_ns - std::min(time_ns, kRoundingNs)) * 1e-9);
      next_due_ns_ = 0;
      was_sought_ = time_ns > 0;
    }
    while (read()) {
      if (asked_fps_ > 0) {
        if (time_ns_ < next_due_ns_) continue;
        // Due times lie on a fixed grid, so that the rate does not drift.
        const double period_ns = 1e9 / asked_fps_;
        next_due_ns_ = int64_t((std::floor(double(time_ns_) / period_ns + 1e-3) + 1) * period_ns) - 500000;
      }
      deliver(frame);
      return NextFrame::kFrame;
    }
    return NextFrame::kEnd;
  }

  void open(double start_s) {
    clip_.emplace(path_, start_s);
    index_ = time_ns_ = -1;
    is_ended_ = false;
  }

  // The reason that the decoder gives, as a sentence to append.
  std::string answer_of_program() const {
    return clip_->problem().empty() ? "" : concatenate(" The program ffmpeg says: ", clip_->problem());
  }

  // The next frame with its number and time; false at the end.
  bool read() {
    if (is_ended_) return false;
    int64_t time_ns = 0;
    if (clip_->read(decoded_, time_ns)) {
      time_ns_ = std::max(time_ns, time_ns_ + 1);
      // After seeking by the clip's mean rate.
      index_ = index_ < 0 && was_sought_ ? std::llround(double(time_ns_) * 1e-9 * clip_fps_) : index_ + 1;
      return true;
    }
    is_ended_ = true;
    if (was_sought_) return false;  // the count of frames is not exact any more
    // Headers give the count only roughly, so a few frames less are no defect.
    const int64_t frames = index_ + 1;
    if (promised_frames_ > frames + 2 + promised_frames_ / 20) {
      throw Error(MAQ_ERROR_UNREADABLE, path_, " ends after ", frames, " of ", promised_frames_,
                  " frames: the file is truncated or damaged; copy it again.", answer_of_program());
    }
    return false;
  }

  void deliver(Frame& frame) {
    if (decoded_.width_px != info_.width_px || decoded_.height_px != info_.height_px) {
      resize_to_bgr(decoded_, info_.width_px, info_.height_px, frame);
    } else {
      uint8_t* pixels = frame.allocate_bgr(decoded_.width_px, decoded_.height_px);
      copy_pixels(decoded_, MAQ_PIXEL_BGR8, pixels, 0, frame.storage.size());
    }
    frame.timestamp_ns = time_ns_;
    frame.clock = MAQ_CLOCK_MEDIA;
    frame.sequence = uint64_t(index_);
  }

  std::string path_;
  std::optional<ClipReader> clip_;
  ImageView decoded_;  // the reader's memory
  SourceInfo info_;
  double clip_fps_ = 0;
  double asked_fps_ = 0;
  int64_t promised_frames_ = -1;
  // Time of the frame that was decoded last.
  int64_t index_ = -1;
  int64_t time_ns_ = -1;
  int64_t next_due_ns_ = 0;
  bool is_ended_ = false;
  bool was_sought_ = false;
  std::optional<int64_t> seek_to_ns_;
};

}  // namespace

std::unique_ptr<Source> open_video_source(SourceUri uri) { return std::make_unique<VideoSource>(std::move(uri)); }

}  // namespace maq
