// How surprising the frames of a stream are, where, and beside those before them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "prediction/codes/frame_encoder.h"
#include "prediction/surprise/code_surprise.h"
#include "prediction/transformer/code_history.h"
#include "prediction/transformer/code_transformer.h"
#include "prediction/transformer/motion_codes.h"

namespace maq {

struct SurpriseScore {
  float bits = 0;         // a code, mean of the frame
  float ratio = 1;        // to the median of the kBefore frames before; 1 where fewer than kMinBefore are known
  bool is_start = false;  // it does not go on from the frame before, and has the bits of codes by themselves
  bool is_cut = false;    // nothing in it follows from the frame before

  bool is_event(float min_ratio) const { return is_cut || ratio >= min_ratio || ratio * min_ratio <= 1; }
};

// Of the latest frame of a stream, in wall-clock milliseconds.
struct SurpriseTimes {
  EncoderTimes encoder;
  float transformer_ms = 0;  // with the picture that motion foresees; 0 where it did not run
};

// Of one stream; several share networks. Not for two threads at once.
class Surprise {
 public:
  static constexpr int64_t kMaxInterval_ns = 1000000000;  // within which a frame goes on from the one before
  // Frames that a frame is compared with, at most and at least.
  static constexpr size_t kBefore = 8, kMinBefore = 4;

  // Without a transformer the table of codes says how likely each is.
  explicit Surprise(std::shared_ptr<FrameEncoder> encoder, std::shared_ptr<CodeTransformer> transformer = nullptr);

  // The stream's next frame, which is not kept. What came before is forgotten where it is of another size, format or
  // clock, earlier, or more than kMaxInterval_ns later, and after a cut. Throws what FrameEncoder::run() and
  // CodeTransformer::bits() throw; what is known of the stream is then as before.
  SurpriseScore push(const Frame& frame);
  // Forgets the frames so far.
  void reset();

  // Of the latest frame, a code's bits by place: [side][side], row by row. Empty before the first.
  const std::vector<float>& map() const { return map_; }
  // Codes of the latest frame: [places][slices]. Of use after the first.
  const std::vector<uint16_t>& codes() const { return codes_; }
  const SurpriseTimes& times() const { return times_; }
  const std::shared_ptr<FrameEncoder>& encoder() const { return encoder_; }
  const std::shared_ptr<CodeTransformer>& transformer() const { return transformer_; }

 private:
  bool is_of_same_kind(const Frame& frame) const;
  bool is_soon_after(const Frame& frame) const;
  float ratio_of(float bits) const;

  // Bits of each of `coming_`, or null where nothing but the table says them.
  const float* foreseen(int64_t time_ns);

  std::shared_ptr<FrameEncoder> encoder_;
  std::shared_ptr<CodeTransformer> transformer_;
  CodeSurprise code_surprise_;
  CodeHistory history_;
  std::optional<MotionCodes> motion_;  // where the transformer is shown it
  std::vector<uint8_t> squeezed_;      // the latest frame, where motion is followed
  std::vector<float> foreseen_;        // [places][slices]
  std::vector<uint16_t> codes_, coming_;
  std::vector<float> map_;
  std::vector<float> before_;  // bits of at most kBefore frames, the latest last
  // Of the frame before.
  bool has_frame_ = false;
  maq_pixel_format format_ = MAQ_PIXEL_BGR8;
  int width_px_ = 0, height_px_ = 0;
  maq_clock clock_ = MAQ_CLOCK_MEDIA;
  int64_t timestamp_ns_ = 0;
  SurpriseTimes times_;
};

}  // namespace maq
