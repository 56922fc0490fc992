// The bytes of a recording. Numbers are little-endian, as on every machine that the SDK runs on.
#pragma once

#include <cstdint>

namespace maq {

inline constexpr char kRecordingMagic[8] = {'M', 'A', 'Q', 'R', 'E', 'C', '\r', '\n'};
inline constexpr char kRecordingEnd[8] = {'M', 'A', 'Q', 'E', 'N', 'D', '\r', '\n'};
inline constexpr uint32_t kRecordingVersion = 1;
inline constexpr uint32_t kFrameMagic = 0x4651414d;  // "MAQF"
inline constexpr uint32_t kJpegEncoding = 100;       // beside the values of maq_pixel_format
inline constexpr uint32_t kMaxHeadBytes = 1 << 20;
inline constexpr uint64_t kMaxIndexBytes = 1 << 28;               // for 16 million frames: six days at 30 a second
inline constexpr int64_t kMaxHorizonUs = 4'000'000'000;           // longer ones are written as that
inline constexpr int64_t kMaxSpanNs = 1'000'000'000'000'000'000;  // from the first frame to the last: 31 years

// Checks are the 64-bit XXH3 hash of https://xxhash.com, or its lower half.

// At the start, before `json_bytes` of JSON.
struct RecordingHead {
  char magic[8];
  uint32_t version;
  uint32_t json_bytes;
  uint64_t json_check;
};
static_assert(sizeof(RecordingHead) == 24);

// Before the pixels of each frame: rows without padding, planes one after the other, then the rows of the depth image.
struct FrameHead {
  uint32_t magic;
  uint32_t head_check;  // checksum of the rest of this struct
  int64_t timestamp_ns;
  uint64_t sequence;
  uint32_t encoding;
  int32_t width_px, height_px;
  int32_t depth_width_px, depth_height_px;
  uint32_t predicted_us;  // a predicted frame: 1 plus its horizon in microseconds; others: 0
  uint64_t picture_bytes;
  uint64_t payload_check;
};
static_assert(sizeof(FrameHead) == 64);

// The index: a RecordingEntry for each frame, and this.
struct RecordingTail {
  uint64_t index_offset;
  uint64_t index_check;
  char magic[8];
};
static_assert(sizeof(RecordingTail) == 24);

}  // namespace maq
