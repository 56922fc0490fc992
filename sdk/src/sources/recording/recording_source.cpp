#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "image/geometry/resize.h"
#include "sources/recording/recording.h"

namespace maq {
namespace {

class RecordingSource : public Source {
 public:
  RecordingSource(SourceUri uri, const Log& log)
      : reader_(uri.target, log), width_px_(uri.width_px), height_px_(uri.height_px), asked_fps_(uri.fps) {
    const double from_s = uri.take_number("from", 0, 0, 1e9);
    const double to_s = uri.take_number("to", 1e9, 0, 1e9);
    uri.expect_no_more_options("from, to, size, fps, live, speed and loop");
    if (to_s <= from_s) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "In ", uri.text, " to=", to_s, " is not after from=", from_s, ".");
    }
    first_ = at_or_after(int64_t(from_s * 1e9));
    end_ = at_or_after(int64_t(to_s * 1e9));
    if (first_ == end_) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, uri.text, " leaves no frame: the recording lasts ",
                  double(time_ns(reader_.frame_count() - 1)) / 1e9, " s.");
    }
    next_ = first_;
    std::optional<RecordedFrame> frame;
    for (size_t index = first_; index < end_ && !frame; ++index) frame = reader_.describe(index);
    if (!frame) throw Error(MAQ_ERROR_UNREADABLE, uri.target, " is damaged in every frame; copy it again.");
    info_.width_px = width_px_ > 0 ? width_px_ : frame->width_px;
    info_.height_px = height_px_ > 0 ? height_px_ : frame->height_px;
    first_sequence_ = frame->sequence;
    // The real rate may differ from the camera's announced rate.
    const double lasted_s = double(time_ns(end_ - 1) - time_ns(first_)) / 1e9;
    const double fps = lasted_s > 0 ? double(end_ - 1 - first_) / lasted_s : reader_.info().fps;
    const bool thinned = asked_fps_ > 0 && asked_fps_ < fps;
    info_.fps = thinned ? asked_fps_ : fps;
    if (!thinned) info_.frame_count = int64_t(end_ - first_);
  }

  const SourceInfo& info() const override { return info_; }
  // The recorded intrinsics; unknown for images of another size.
  const maq_intrinsics* intrinsics() const override {
    return reader_.info().intrinsics && width_px_ == 0 ? &*reader_.info().intrinsics : nullptr;
  }

  bool can_seek() const override { return true; }
  void seek(int64_t wanted_ns) override {
    next_ = std::clamp(at_or_after(time_ns(first_) + std::min(wanted_ns, time_ns(end_ - 1) + 1)), first_, end_);
    next_due_ns_ = 0;
  }

 private:
  NextFrame read(int64_t, Frame& frame) override {
    while (next_ < end_ && asked_fps_ > 0 && time_ns(next_) < next_due_ns_) ++next_;
    if (next_ >= end_) return NextFrame::kEnd;
    const size_t index = next_++;  // a damaged one is reported once
    if (asked_fps_ > 0) {
      const double period_ns = 1e9 / asked_fps_;
      next_due_ns_ = int64_t((std::floor(double(time_ns(index)) / period_ns + 1e-3) + 1) * period_ns) - 500000;
    }
    if (width_px_ > 0) {
      reader_.read(index, recorded_);
      resize_to_bgr(recorded_.image, width_px_, height_px_, frame);
      frame.sequence = recorded_.sequence;
      frame.origin = recorded_.origin;
    } else {
      reader_.read(index, frame);
    }
    frame.sequence = frame.sequence > first_sequence_ ? frame.sequence - first_sequence_ : 0;
    frame.timestamp_ns = time_ns(index) - time_ns(first_);
    frame.origin = frame.origin.moved_to(frame.timestamp_ns, frame.sequence);
    frame.clock = MAQ_CLOCK_MEDIA;
    return NextFrame::kFrame;
  }

  int64_t time_ns(size_t index) const { return reader_.timestamp_ns(index) - reader_.timestamp_ns(0); }

  size_t at_or_after(int64_t wanted_ns) const {
    size_t low = 0, high = reader_.frame_count();
    while (low < high) {
      const size_t middle = (low + high) / 2;
      if (time_ns(middle) < wanted_ns) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  RecordingReader reader_;
  int width_px_, height_px_;  // asked for; 0: as recorded
  double asked_fps_;
  SourceInfo info_;
  size_t first_ = 0, end_ = 0, next_ = 0;
  int64_t next_due_ns_ = 0;
  uint64_t first_sequence_ = 0;
  Frame recorded_;
};

}  // namespace

std::unique_ptr<Source> open_recording_source(SourceUri uri, const Log& log) {
  return std::make_unique<RecordingSource>(std::move(uri), log);
}

}  // namespace maq
