// Fault injection: the faults of cameras, put into any source by its URI, so that an app can be tested against them.
#pragma once

#include <optional>

#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// Something that happens once: before frame number `frame`, or `at_ns` after the source was opened.
struct FaultEvent {
  int64_t frame = -1;
  int64_t at_ns = -1;
  int64_t lasts_ns = 0;  // INT64_MAX: indefinitely
};

struct FaultPlan {
  double drop = 0;                   // the probability that a frame is lost
  double corrupt = 0;                // that a frame is damaged: noise over some rows, or a truncated JPEG image
  int64_t jitter_ns = 0;             // each frame arrives late by a random time up to this
  std::optional<FaultEvent> stall;   // no frames come
  std::optional<FaultEvent> unplug;  // the device is disconnected
  std::optional<FaultEvent> hang;    // the device does not answer, and cannot be woken
  uint64_t seed = 1;

  bool is_empty() const;
};

inline constexpr char kFaultOptions[] = "drop, corrupt, jitter, stall, unplug, hang and fault_seed";

// Takes the options off the URI: "drop=0.1", "corrupt=0.1", "jitter=20ms", "stall=2s@10s" (for 2 s after 10 s),
// "stall=2s@100" (at frame 100), "unplug@5s" (indefinitely), "unplug=3s@5s", "hang=3s@5s", "fault_seed=7".
// Throws MAQ_ERROR_INVALID_ARGUMENT.
FaultPlan take_faults(SourceUri& uri);

// Adds the faults of the plan to the cameras that `open` opens: the same faults for the same seed and frames. The
// plan's time and frame count continue when a camera is opened again.
CameraOpener with_faults(CameraOpener open, const FaultPlan& plan);

}  // namespace maq
