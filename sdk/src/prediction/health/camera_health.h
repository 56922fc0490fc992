// Tells whether the camera of a stream is all right: cuts, freezes, black or covered pictures, knocks, new objects.
#pragma once

#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "prediction/health/health_rules.h"
#include "prediction/health/picture_match.h"

namespace maq {

// For one stream. Not for two threads at once.
class CameraHealth {
 public:
  static constexpr int64_t kMaxInterval_ns = 1000000000;  // a stream continues within this time

  // Checks the stream's next frame, which is not kept. A frame of another size, format or clock, an earlier time, or
  // more than kMaxInterval_ns later starts a new stream. Throws MAQ_ERROR_UNSUPPORTED for a depth image; the stream is
  // then unchanged. Allocates nothing for a known size.
  HealthResult push(const Frame& frame);
  // Forgets the stream.
  void reset();

  // Returns the patches of the latest frame, and how far motion leaves each unexplained, 0 to 1. No patches for frames
  // below some 32 pixels, of which only freezes and black pictures are found.
  const PictureMatch& match() const { return match_; }

 private:
  bool continues(const Frame& frame) const;

  WorkerThreads threads_{1};
  LumaPyramid luma_;
  SmallPicture picture_, before_;
  PictureMatch match_;
  HealthRules rules_;
  // The frame before:
  bool has_frame_ = false;
  maq_pixel_format format_ = MAQ_PIXEL_BGR8;
  int width_px_ = 0, height_px_ = 0;
  maq_clock clock_ = MAQ_CLOCK_MEDIA;
  int64_t timestamp_ns_ = 0;
  uint64_t checksum_ = 0;
};

}  // namespace maq
