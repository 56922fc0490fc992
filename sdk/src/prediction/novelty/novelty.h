// The novelty of the frames of a stream: bits per code, a map, and the ratio to recent frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "prediction/codec/frame_encoder.h"
#include "prediction/novelty/code_novelty.h"
#include "prediction/transformer/code_history.h"
#include "prediction/transformer/code_transformer.h"
#include "prediction/transformer/motion_codes.h"

namespace maq {

struct NoveltyScore {
  float bits = 0;                // mean of all codes
  float ratio = 1;               // to the median of the last kBefore frames; 1 while fewer than kMinBefore are known
  bool is_stream_start = false;  // the frame continues no stream and is scored by the unigram prior
  bool is_cut = false;           // the frame before does not make this one more likely

  bool is_event(float min_ratio) const { return is_cut || ratio >= min_ratio || ratio * min_ratio <= 1; }
};

// Wall-clock milliseconds of the latest frame.
struct NoveltyTimes {
  EncoderTimes encoder;
  float transformer_ms = 0;  // with the motion prediction; 0: it did not run
};

// For one stream; streams may share networks. Not for two threads at once.
class Novelty {
 public:
  static constexpr int64_t kMaxInterval_ns = 1000000000;  // a stream continues within this time
  // The number of recent frames in the median, at most and at least.
  static constexpr size_t kBefore = 8, kMinBefore = 4;

  // Without a transformer, the bigram prior is used.
  explicit Novelty(std::shared_ptr<FrameEncoder> encoder, std::shared_ptr<CodeTransformer> transformer = nullptr);

  // Scores the stream's next frame, which is not kept. A frame of another size, format or clock, an earlier time, or
  // more than kMaxInterval_ns later starts a new stream. Throws the exceptions of FrameEncoder::encode() and
  // CodeTransformer::bits(); the stream is then unchanged.
  NoveltyScore push(const Frame& frame);
  // Forgets the stream.
  void reset();

  // Mean bits of a code by cell of the latest frame, [side][side]. Empty before the first frame.
  const std::vector<float>& map() const { return map_; }
  // Codes of the latest frame, [cells][groups]; undefined before the first frame.
  const std::vector<uint16_t>& codes() const { return codes_; }
  const NoveltyTimes& times() const { return times_; }
  const std::shared_ptr<FrameEncoder>& encoder() const { return encoder_; }
  const std::shared_ptr<CodeTransformer>& transformer() const { return transformer_; }

 private:
  bool is_of_same_kind(const Frame& frame) const;
  bool is_soon_after(const Frame& frame) const;
  float ratio_of(float bits) const;

  // Returns the bits of each of `coming_` by the transformer; null without one.
  const float* predicted_bits(int64_t time_ns);

  std::shared_ptr<FrameEncoder> encoder_;
  std::shared_ptr<CodeTransformer> transformer_;
  CodeNovelty code_novelty_;
  CodeHistory history_;
  std::optional<MotionCodes> motion_;  // if the transformer has that input
  std::vector<uint8_t> input_rgb_;     // the latest frame, with motion_
  std::vector<float> predicted_bits_;  // [cells][groups]
  std::vector<uint16_t> codes_, coming_;
  std::vector<float> map_;
  std::vector<float> before_;  // bits of the last kBefore frames, the latest last
  // The frame before:
  bool has_frame_ = false;
  maq_pixel_format format_ = MAQ_PIXEL_BGR8;
  int width_px_ = 0, height_px_ = 0;
  maq_clock clock_ = MAQ_CLOCK_MEDIA;
  int64_t timestamp_ns_ = 0;
  NoveltyTimes times_;
};

}  // namespace maq
