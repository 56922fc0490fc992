// Faults that a URI asks for, so that an app can be tried against what cameras do: any source, and any camera.
#pragma once

#include <optional>

#include "sources/camera_backend.h"
#include "sources/uri.h"

namespace maq {

// Something that happens once: before frame number `frame`, or `at_ns` after the source was opened.
struct FaultEvent {
  int64_t frame = -1;
  int64_t at_ns = -1;
  int64_t lasts_ns = 0;  // INT64_MAX: for ever
};

struct FaultPlan {
  double drop = 0;                   // the share of frames that are lost
  double corrupt = 0;                // the share of frames with damage: noise over some rows, or a JPEG image cut short
  int64_t jitter_ns = 0;             // each frame arrives late by a random time up to this
  std::optional<FaultEvent> stall;   // no frames come
  std::optional<FaultEvent> unplug;  // the device is gone
  std::optional<FaultEvent> hang;    // the device does not answer, and cannot be woken
  uint64_t seed = 1;

  bool is_empty() const;
};

inline constexpr char kFaultOptions[] = "drop, corrupt, jitter, stall, unplug, hang and fault_seed";

// Takes the options off the URI: "drop=0.1", "corrupt=0.1", "jitter=20ms", "stall=2s@10s" (for 2 s after 10 s),
// "stall=2s@100" (at frame 100), "unplug@5s" (for ever), "unplug=3s@5s", "hang=3s@5s", "fault_seed=7".
// Throws MAQ_ERROR_INVALID_ARGUMENT.
FaultPlan take_faults(SourceUri& uri);

// Cameras as `open` opens them, with the faults of the plan: the same ones for the same seed and frames. Its time and
// its frames go on when a camera is opened anew.
CameraOpener with_faults(CameraOpener open, const FaultPlan& plan);

}  // namespace maq
