// A stream of uncompressed images in the container NUT (FFmpeg's nut.txt, version 3), read from a pipe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace maq {

class NutStream {
 public:
  // Reads up to the first image. The descriptor stays the caller's.
  explicit NutStream(int fd);

  bool is_open() const { return is_open_; }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  double fps() const { return fps_; }

  // Reads the next image of 3 bytes a pixel, and its time. False at the end and for anything unexpected.
  bool read(std::vector<uint8_t>& pixels, int64_t& time_ns);

 private:
  // The meaning of a frame's first byte.
  struct FrameCode {
    uint64_t flags, stream, size_factor, size_offset, reserved;
    int64_t pts_step;
    uint64_t header;
  };
  class Packet;

  bool fill();
  int next_byte();  // -1 at the end
  bool read_bytes(uint8_t* to, size_t count);
  uint64_t number();
  bool read_packet(int startcode);
  void read_main_header(Packet& packet);
  void read_stream_header(Packet& packet);
  void read_info(Packet& packet);
  int64_t pts_of(uint64_t coded) const;

  const int fd_;
  bool is_open_ = false, is_broken_ = false;
  std::vector<uint8_t> buffer_;
  size_t at_ = 0, filled_ = 0;
  int first_byte_ = -1;  // of the next frame
  std::array<FrameCode, 256> codes_{};
  std::vector<std::vector<uint8_t>> elided_{1};  // beginnings that frames leave out
  uint64_t time_numerator_ = 0, time_denominator_ = 1, time_bases_ = 1, pts_bits_ = 0;
  int64_t last_pts_ = 0;
  int width_px_ = 0, height_px_ = 0;
  double fps_ = 0;
};

}  // namespace maq
