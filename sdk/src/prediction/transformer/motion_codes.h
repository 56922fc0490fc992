// The picture that motion alone foresees, and its codes: what networks are shown beside the frames before.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/frame.h"
#include "prediction/codes/frame_encoder.h"
#include "prediction/predictor.h"

namespace maq {

// Of one stream, in frames as the networks see them.
class MotionCodes {
 public:
  explicit MotionCodes(std::shared_ptr<FrameEncoder> encoder);

  // The stream's next frame: R, G, B of [frame_px][frame_px].
  void add(const uint8_t* rgb, int64_t time_ns);
  void reset();

  // Of what will be there at `coming_ns`, which is not before the newest frame and at most Predictor::kMaxAhead_ns
  // after it: [places][slices], until the next call; null until two frames have shown how things move. `newest`: codes
  // of the newest frame, which it is where nothing moves. Throws what FrameEncoder::run() throws.
  const uint16_t* at(int64_t coming_ns, const uint16_t* newest);
  // That picture: R, G, B of [frame_px][frame_px].
  const uint8_t* picture(int64_t coming_ns);

 private:
  std::shared_ptr<FrameEncoder> encoder_;
  Predictor predictor_;
  Frame seen_, moved_;
  std::vector<uint16_t> codes_;
  int64_t newest_ns_ = 0;
  size_t frames_ = 0;
};

}  // namespace maq
