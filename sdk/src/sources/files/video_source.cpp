#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <thread>
#include <utility>

#include "core/error.h"
#include "core/files/file.h"
#include "core/memory.h"
#include "core/thread.h"
#include "image/convert.h"
#include "image/files/file_codecs.h"
#include "image/geometry/resize.h"
#include "sources/files/file_sources.h"

namespace maq {
namespace {

constexpr double kMaxFrames = 1e9;
constexpr size_t kDecoderBytes = size_t(64) << 20;  // more than it takes; without, it ends early
constexpr size_t kMaxDecoderThreads = 16;
constexpr double kMaxTimeMs = 1e12;       // decades, in nanoseconds far from the end of 64 bits
constexpr int64_t kSameTimeNs = 1500000;  // containers round times to milliseconds

class VideoSource : public Source {
 public:
  explicit VideoSource(SourceUri uri) : path_(uri.target), asked_fps_(uri.fps) {
    uri.expect_no_more_options("size and fps");
    open_file(path_);  // throws for a path that is not a file: decoders would wait for a pipe, and seek in it
    open();
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
    if (std::isfinite(count) && count >= 1 && count < kMaxFrames) {
      promised_frames_ = int64_t(count);
      info_.frame_count = thinned ? int64_t(std::ceil(count * asked_fps_ / clip_fps_)) : promised_frames_;
    }
  }

  const SourceInfo& info() const override { return info_; }

  bool can_seek() const override { return true; }
  void seek(int64_t time_ns) override { seek_to_ns_ = time_ns; }

 private:
  NextFrame read(int64_t, Frame& frame) override {
    if (seek_to_ns_) find(*std::exchange(seek_to_ns_, std::nullopt));
    while (std::exchange(is_ahead_, false) || read()) {
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

  void open() {
    clip_ = file_codecs().open_clip(path_);
    if (clip_ != nullptr) return;
    // FFmpeg opens no clip where the threads of its decoder, one for each processor, do not start.
    require_threads(std::min<size_t>(std::thread::hardware_concurrency(), kMaxDecoderThreads));
    throw Error(MAQ_ERROR_UNREADABLE, path_, " cannot be opened as a video: it is truncated, damaged or no video. ",
                "Use a whole MP4, AVI, MOV or WebM file.");
  }

  // The next frame with its number and time; false at the end.
  bool decode() {
    if (!is_ended_) is_ended_ = !clip_->read(decoded_);
    if (is_ended_) return false;
    ++index_;
    time_ns_ = presentation_time_ns();
    return true;
  }

  bool read() {
    if (is_ended_) return false;
    if (decode()) return true;
    if (was_sought_) return false;  // the count of frames is not exact any more
    if (index_ < 0) {
      require_memory(kDecoderBytes);
      throw Error(MAQ_ERROR_UNREADABLE, path_, " has no frame that can be decoded: it is truncated or damaged.");
    }
    // Headers of clips with a varying frame rate give the count only roughly, so a few frames less are no defect.
    const int64_t frames = index_ + 1;
    if (promised_frames_ > frames + 2 + promised_frames_ / 20) {
      require_memory(kDecoderBytes);
      throw Error(MAQ_ERROR_UNREADABLE, path_, " ends after ", frames, " of ", promised_frames_,
                  " frames: the file is truncated or damaged; copy it again.");
    }
    return false;
  }

  // Never runs backwards. Some decoders do not report the time of the first frame (0), of the last frames (held back
  // for reordering), or of any frame. Such frames divide the rest of the clip evenly.
  int64_t presentation_time_ns() const {
    const double reported_ms = clip_->position_ms();
    if (std::isfinite(reported_ms) && reported_ms > 0) {
      return std::max(int64_t(std::llround(std::min(reported_ms, kMaxTimeMs) * 1e6)), time_ns_ + 1);
    }
    const int64_t grid_ns = std::llround(double(index_) * 1e9 / clip_fps_);
    const auto period_ns = int64_t(1e9 / clip_fps_);
    if (time_ns_ < 0 || std::abs(grid_ns - period_ns - time_ns_) < kSameTimeNs) return std::max(grid_ns, time_ns_ + 1);
    const int64_t left_ns = std::llround(double(promised_frames_) * 1e9 / clip_fps_) - time_ns_;
    const int64_t left_frames = promised_frames_ - index_;
    return time_ns_ + (left_frames > 0 && left_ns > left_frames ? left_ns / (left_frames + 1) : period_ns);
  }

  // Decodes up to the first frame at that time or later, from a frame before it that can be decoded on its own.
  void find(int64_t time_ns) {
    is_ahead_ = false;
    next_due_ns_ = 0;
    was_sought_ = true;
    is_ended_ = promised_frames_ > 0 && double(time_ns) > double(promised_frames_) * 1e9 / clip_fps_ + 1e9;
    if (is_ended_) return;
    if (!goes_near(time_ns)) {
      open();
      index_ = -1;
      time_ns_ = -1;
      is_ended_ = false;
    } else if (time_ns_ >= time_ns) {
      is_ahead_ = true;
      return;
    }
    while (decode()) {
      if (time_ns_ < time_ns) continue;
      is_ahead_ = true;
      return;
    }
  }

  // Decodes a frame that is not later than `time_ns`, not long before it. False where that cannot be done: the clip has
  // to be decoded from its beginning.
  bool goes_near(int64_t time_ns) {
    // Decoders land up to a few frames beside the time asked for.
    for (const int64_t margin_ns : {int64_t(500000000), int64_t(5000000000)}) {
      if (time_ns <= margin_ns || !clip_->seek_ms(double(time_ns - margin_ns) * 1e-6)) return false;
      is_ended_ = false;
      time_ns_ = -1;
      if (!clip_->read(decoded_)) continue;
      const double number = clip_->frame_number();
      if (!(number >= 0 && number < kMaxFrames)) return false;
      index_ = std::llround(number);
      time_ns_ = presentation_time_ns();
      if (time_ns_ <= time_ns) return true;
    }
    return false;
  }

  void deliver(Frame& frame) {
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
    frame.timestamp_ns = time_ns_;
    frame.clock = MAQ_CLOCK_MEDIA;
    frame.sequence = uint64_t(index_);
  }

  std::string path_;
  std::unique_ptr<ClipDecoder> clip_;
  ImageView decoded_;  // the decoder's memory
  SourceInfo info_;
  double clip_fps_ = 0;
  double asked_fps_ = 0;
  int64_t promised_frames_ = -1;
  // Time of the frame that was decoded last.
  int64_t index_ = -1;
  int64_t time_ns_ = -1;
  bool is_ahead_ = false;  // it is still to be delivered
  int64_t next_due_ns_ = 0;
  bool is_ended_ = false;
  bool was_sought_ = false;
  std::optional<int64_t> seek_to_ns_;
};

}  // namespace

std::unique_ptr<Source> open_video_source(SourceUri uri) { return std::make_unique<VideoSource>(std::move(uri)); }

}  // namespace maq
