// What every source is.
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
  // Frames lost so far, on their way or because the app did not take them.
  virtual uint64_t drops() const { return 0; }
  // Null when the source does not know.
  virtual const maq_intrinsics* intrinsics() const { return nullptr; }
  // As those of a camera; every other source throws MAQ_ERROR_UNSUPPORTED.
  virtual maq_control_info control(maq_control which);
  virtual void set_control(maq_control which, double value);
  // Throws MAQ_ERROR_UNSUPPORTED where it cannot be done.
  virtual bool can_seek() const { return false; }
  virtual void seek(int64_t time_ns);
  // Fills `frame` (pixels, time, sequence) with the next frame, unless it says something else. Pixels may be those that
  // the frame had before; the rest is clear (Frame::clear).
  virtual NextFrame next(int64_t timeout_ns, Frame& frame) = 0;
  // From any thread, for good: where next() waits, it returns kStopped, now and later. Others end what they decode.
  virtual void stop() {}
  // After stop(): returns when no state callback runs any more; in a state callback, at once.
  virtual void wait_for_report() {}
  // From any thread: a descriptor of the source that is readable while next() would not wait. Throws
  // MAQ_ERROR_UNSUPPORTED where it never does.
  virtual int event_fd();
};

// Of maq_source_config, whose comments say what they mean.
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
