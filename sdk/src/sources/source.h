// The interface of all sources.
#pragma once

#include <cstdint>

#include "core/frame.h"
#include "core/log.h"
#include "maquette/source.h"

namespace maq {

struct SourceInfo {
  int width_px = 0;
  int height_px = 0;
  double fps = 0;            // 0 for a single image
  int64_t frame_count = -1;  // -1: not known, or endless
  bool is_live = false;
  maq_clock clock = MAQ_CLOCK_MEDIA;
};

enum class NextFrame { kFrame, kEnd, kTimeout, kStopped };

class Source {
 public:
  virtual ~Source() = default;
  virtual const SourceInfo& info() const = 0;
  // Returns the number of frames lost so far: in transit, or because the app did not take them.
  virtual uint64_t drops() const { return 0; }
  // Returns null if they are unknown.
  virtual const maq_intrinsics* intrinsics() const { return nullptr; }
  // Controls of a camera; other sources throw MAQ_ERROR_UNSUPPORTED.
  virtual maq_source_control_info control(maq_source_control which);
  virtual void set_control(maq_source_control which, double value);
  // Throws MAQ_ERROR_UNSUPPORTED unless can_seek().
  virtual bool can_seek() const { return false; }
  virtual void seek(int64_t time_ns);
  // Fills `frame` with the next frame if it returns kFrame. The frame carries the intrinsics of the source. The caller
  // has cleared it (Frame::clear).
  NextFrame next(int64_t timeout_ns, Frame& frame) {
    const NextFrame status = read(timeout_ns, frame);
    const maq_intrinsics* const known = status == NextFrame::kFrame ? intrinsics() : nullptr;
    frame.intrinsics = known == nullptr ? maq_intrinsics{} : *known;
    return status;
  }
  // From any thread, for good: a waiting next() returns kStopped, now and later. Other sources finish decoding.
  virtual void stop() {}
  // After stop(): waits until no state callback runs; inside a state callback it returns at once.
  virtual void wait_for_report() {}
  // From any thread: returns a descriptor that is readable while next() would not wait. Throws MAQ_ERROR_UNSUPPORTED if
  // next() never waits.
  virtual int event_fd();

 private:
  // Fills pixels, time and sequence of the frame for next(). Its memory may hold the pixels of an earlier frame.
  virtual NextFrame read(int64_t timeout_ns, Frame& frame) = 0;
};

// The settings of maq_source_config, which explains them.
struct SourceSettings {
  int pool_size = 4;
  int queue_length = 1;
  int stall_ms = 2000;
  int reconnect_ms = 30000;
  bool real_time = false;
  bool loop = false;
  int max_side_px = 0;
  maq_source_state_callback on_state = nullptr;
  void* user_data = nullptr;
  Log log;
};

}  // namespace maq
