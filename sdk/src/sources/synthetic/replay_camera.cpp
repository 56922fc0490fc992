#include "sources/synthetic/replay_camera.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <optional>

#include "core/clock.h"
#include "core/error.h"
#include "core/files/event_fd.h"

namespace maq {
namespace {

using Clock = MonotonicClock;
using std::chrono::nanoseconds;

constexpr double kStillFps = 30;  // rate of a single image, which is repeated
constexpr double kMaxNs = 1e18;   // 31 years: sums of a few of these fit

nanoseconds limited_ns(double ns) { return nanoseconds(int64_t(std::min(ns, kMaxNs))); }

// The source, and when each of its frames is due.
class ReplaySchedule {
 public:
  ReplaySchedule(std::function<std::unique_ptr<Source>()> open, ReplayOptions options)
      : open_(std::move(open)), options_(options), source_(open_()), can_seek_(source_->can_seek()) {}

  const SourceInfo& info() const { return source_->info(); }
  const maq_intrinsics* intrinsics() const { return source_->intrinsics(); }
  double fps() const { return (info().fps > 0 ? info().fps : kStillFps) * options_.speed; }

  struct Next {
    Clock::time_point due;
    uint32_t sequence;
    bool damaged;
  };

  // Reads the next frame; nothing at the end.
  std::optional<Next> read(Frame& frame) {
    frame.clear();
    bool damaged = false;
    for (bool again = false;; again = true) {
      try {
        if (source_->next(0, frame) == NextFrame::kFrame) break;
      } catch (const Error& error) {
        if (error.status() != MAQ_ERROR_UNREADABLE || readable_ == 0) throw;
        damaged = true;  // a camera would drop the frame
        break;
      }
      if (!options_.loop || again) return {};
      source_ = open_();
      lap_ns_ = last_ns_ + int64_t(1e9 * options_.speed / fps());
      lap_sequence_ = last_sequence_ + 1;
    }
    if (!damaged) {
      ++readable_;
      last_ns_ = lap_ns_ + frame.timestamp_ns;
      last_sequence_ = lap_sequence_ + frame.sequence;
    } else {
      ++last_sequence_;
    }
    const nanoseconds after_begin = limited_ns(double(last_ns_) / options_.speed);
    if (!begin_) begin_ = Clock::now() - after_begin;
    return Next{*begin_ + after_begin, uint32_t(last_sequence_), damaged};
  }

  bool can_seek() const { return can_seek_; }

  void seek(int64_t time_ns) {
    source_->seek(time_ns);
    lap_ns_ = 0;
    lap_sequence_ = 0;
    begin_.reset();
    ++seeks_;
  }
  uint32_t seeks() const { return seeks_; }

 private:
  std::function<std::unique_ptr<Source>()> open_;
  ReplayOptions options_;
  std::unique_ptr<Source> source_;
  const bool can_seek_;
  std::optional<Clock::time_point> begin_;  // when time 0 of the source was, or would have been
  int64_t readable_ = 0;
  uint32_t seeks_ = 0;
  int64_t last_ns_ = 0, lap_ns_ = 0;
  uint64_t last_sequence_ = 0, lap_sequence_ = 0;
};

class ReplayCamera : public Camera {
 public:
  ReplayCamera(std::shared_ptr<ReplaySchedule> schedule, std::string identity, int buffers)
      : schedule_(std::move(schedule)), identity_(std::move(identity)), slots_(size_t(buffers)) {
    next_ = schedule_->read(ahead_);
    format_.pixels = ahead_.image.format;
    format_.width_px = schedule_->info().width_px;
    format_.height_px = schedule_->info().height_px;
    format_.fps = schedule_->fps();
    max_delay_ = limited_ns(buffers * 1e9 / format_.fps);
  }

  const CameraFormat& format() const override { return format_; }
  const std::string& identity() const override { return identity_; }
  const maq_intrinsics* intrinsics() const override { return schedule_->intrinsics(); }
  void close() override {}

  void give_back(int slot) override {
    std::lock_guard<std::mutex> lock(mutex_);
    slots_[size_t(slot)].is_free = true;
  }

  void seek(int64_t time_ns) override {
    if (!schedule_->can_seek()) Camera::seek(time_ns);  // throws
    std::lock_guard<std::mutex> lock(mutex_);
    seek_to_ns_ = time_ns;
  }

  Event wait(int wake_fd, int timeout_ms, CameraBuffer& buffer, std::string&) override {
    const auto deadline = Clock::now() + std::chrono::milliseconds(timeout_ms);
    for (;;) {
      seek_if_asked();
      if (!next_) {
        next_ = schedule_->read(ahead_);
        if (!next_) return Event::kEnd;
      }
      if (const bool woken = sleep_until(wake_fd, std::min(next_->due, deadline)); woken) return Event::kWoken;
      if (Clock::now() < next_->due) return Event::kTimeout;
      const ReplaySchedule::Next now = *next_;
      next_.reset();
      // Frames from before the camera was opened, and frames for which a device would have had no buffer left.
      if (now.due < opened_ || Clock::now() - now.due > max_delay_) continue;
      const int slot = free_slot();
      if (slot < 0) continue;  // the app holds all: the frame is lost
      Frame& frame = slots_[size_t(slot)].frame;
      std::swap(frame, ahead_);
      buffer.image = frame.image;
      buffer.depth = frame.depth;
      buffer.origin = frame.origin;
      buffer.slot = slot;
      buffer.timestamp_ns = to_ns(now.due);
      buffer.sequence = now.sequence;
      buffer.damaged = now.damaged;
      buffer.seeks = schedule_->seeks();
      return Event::kFrame;
    }
  }

 private:
  struct Slot {
    Frame frame;
    bool is_free = true;
  };

  // True when woken before.
  static bool sleep_until(int wake_fd, Clock::time_point time) {
    const int64_t left_ns = std::max<int64_t>(0, nanoseconds(time - Clock::now()).count());
    return wait_for_event(wake_fd, left_ns);
  }

  int free_slot() {
    std::lock_guard<std::mutex> lock(mutex_);
    for (size_t i = 0; i < slots_.size(); ++i) {
      last_slot_ = (last_slot_ + 1) % slots_.size();  // round robin, so that each gets its memory early
      if (!slots_[last_slot_].is_free) continue;
      slots_[last_slot_].is_free = false;
      return int(last_slot_);
    }
    return -1;
  }

  void seek_if_asked() {
    std::optional<int64_t> time_ns;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      time_ns.swap(seek_to_ns_);
    }
    if (!time_ns) return;
    schedule_->seek(*time_ns);
    next_.reset();
  }

  std::shared_ptr<ReplaySchedule> schedule_;
  std::string identity_;
  const Clock::time_point opened_ = Clock::now();
  CameraFormat format_;
  nanoseconds max_delay_;
  Frame ahead_;  // read before it is due
  std::optional<ReplaySchedule::Next> next_;
  std::mutex mutex_;  // guards the rest
  std::vector<Slot> slots_;
  size_t last_slot_ = 0;
  std::optional<int64_t> seek_to_ns_;
};

}  // namespace

CameraOpener replay_as_camera(std::function<std::unique_ptr<Source>()> open, std::string identity,
                              ReplayOptions options) {
  auto schedule = std::make_shared<ReplaySchedule>(std::move(open), options);
  return [schedule, identity = std::move(identity), options] {
    return std::make_shared<ReplayCamera>(schedule, identity, options.buffers);
  };
}

}  // namespace maq
