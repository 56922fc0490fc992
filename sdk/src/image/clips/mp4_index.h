// The boxes of an MP4 file around VP9 frames of one rate (ISO/IEC 14496-12; "VP Codec ISO Media File Format Binding",
// 1.0). Frames lie in chunks; the index follows them, so that the file is written from front to back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace maq {

class Mp4Index {
 public:
  // `fps` counts in steps of 0.001.
  Mp4Index(int width_px, int height_px, double fps);

  // The first box of the file.
  static std::vector<uint8_t> file_head();
  static constexpr size_t kChunkHeadBytes = 8;
  // The head of a box of frames, fewer than 4 GiB.
  static std::vector<uint8_t> chunk_head(size_t frame_bytes);

  void add_frame(size_t bytes, bool is_key);
  // Ends the chunk of the frames since the last call. `offset`: of its first frame in the file.
  void end_chunk(uint64_t offset);

  // The last box.
  std::vector<uint8_t> index() const;

 private:
  struct Chunk {
    uint64_t offset;
    uint32_t frames;
  };

  int width_px_, height_px_;
  uint32_t ticks_a_second_;
  std::vector<uint32_t> frame_bytes_;
  std::vector<uint32_t> key_frames_;  // from 1
  std::vector<Chunk> chunks_;
  size_t frames_in_chunks_ = 0;
};

}  // namespace maq
