#include "image/clips/mp4_index.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace maq {
namespace {

constexpr uint32_t kTicksAFrame = 1000;
constexpr uint32_t kOne = 1 << 16;  // of numbers with 16 bits of fraction

// Numbers are big-endian. A box begins with its size, which is known at its end.
class Boxes {
 public:
  template <class Fill>
  void box(const char* type, const Fill& fill) {
    const size_t begin = bytes.size();
    put<uint32_t>(0);
    text(type, 4);
    fill();
    const uint64_t size = bytes.size() - begin;
    for (size_t i = 0; i < 4; ++i) bytes[begin + i] = uint8_t(size >> 8 * (3 - i));
  }
  template <class Fill>
  void full_box(const char* type, uint32_t version_and_flags, const Fill& fill) {
    box(type, [&] {
      put<uint32_t>(version_and_flags);
      fill();
    });
  }
  template <class Number>
  void put(Number value) {
    for (size_t i = sizeof value; i-- > 0;) bytes.push_back(uint8_t(uint64_t(value) >> 8 * i));
  }
  void zeros(size_t count) { bytes.insert(bytes.end(), count, 0); }
  // Filled up with zeros.
  void text(const char* characters, size_t size) {
    const size_t length = std::strlen(characters);
    for (size_t i = 0; i < size; ++i) bytes.push_back(i < length ? uint8_t(characters[i]) : uint8_t(0));
  }
  void unit_matrix() {
    for (const uint32_t value : {kOne, 0u, 0u, 0u, kOne, 0u, 0u, 0u, 1u << 30}) put(value);
  }

  std::vector<uint8_t> bytes;
};

constexpr uint32_t kVersion1 = 1 << 24;  // times have 64 bits

// The smallest level of VP9 that has such images (VP9 bitstream specification, annex A).
uint8_t level_of(int width_px, int height_px, double fps) {
  struct Level {
    uint8_t number;
    double pixels_a_second, pixels;
  };
  constexpr Level kLevels[] = {{10, 829440, 36864},         {11, 2764800, 73728},       {20, 4608000, 122880},
                               {21, 9216000, 245760},       {30, 20736000, 552960},     {31, 36864000, 983040},
                               {40, 83558400, 2228224},     {41, 160432128, 2228224},   {50, 311951360, 8912896},
                               {51, 588251136, 8912896},    {52, 1176502272, 8912896},  {60, 1176502272, 35651584},
                               {61, 2353004544., 35651584}, {62, 4706009088., 35651584}};
  const double pixels = double(width_px) * height_px;
  for (const Level& level : kLevels) {
    if (pixels <= level.pixels && pixels * fps <= level.pixels_a_second) return level.number;
  }
  return 62;
}

}  // namespace

Mp4Index::Mp4Index(int width_px, int height_px, double fps)
    : width_px_(width_px), height_px_(height_px), ticks_a_second_(uint32_t(std::lround(fps * kTicksAFrame))) {}

std::vector<uint8_t> Mp4Index::file_head() {
  Boxes file;
  file.box("ftyp", [&] {
    file.text("isom", 4);
    file.put<uint32_t>(512);
    file.text("isom", 4);
    file.text("iso2", 4);
    file.text("mp41", 4);
  });
  return file.bytes;
}

std::vector<uint8_t> Mp4Index::chunk_head(size_t frame_bytes) {
  Boxes file;
  file.put(uint32_t(kChunkHeadBytes + frame_bytes));
  file.text("mdat", 4);
  return file.bytes;
}

void Mp4Index::add_frame(size_t bytes, bool is_key) {
  frame_bytes_.push_back(uint32_t(bytes));
  if (is_key) key_frames_.push_back(uint32_t(frame_bytes_.size()));
}

void Mp4Index::end_chunk(uint64_t offset) {
  chunks_.push_back({offset, uint32_t(frame_bytes_.size() - frames_in_chunks_)});
  frames_in_chunks_ = frame_bytes_.size();
}

std::vector<uint8_t> Mp4Index::index() const {
  const uint64_t duration = uint64_t(frame_bytes_.size()) * kTicksAFrame;
  Boxes file;
  const auto times = [&] {  // made and changed; 0: not told, so that equal images make equal files
    file.put<uint64_t>(0);
    file.put<uint64_t>(0);
  };
  const auto sample_entry = [&] {
    file.box("vp09", [&] {
      file.zeros(6);
      file.put<uint16_t>(1);  // the file itself
      file.zeros(16);
      file.put(uint16_t(width_px_));
      file.put(uint16_t(height_px_));
      file.put<uint32_t>(72 * kOne);  // pixels an inch, as files have it
      file.put<uint32_t>(72 * kOne);
      file.zeros(4);
      file.put<uint16_t>(1);  // frames a sample
      file.zeros(32);
      file.put<uint16_t>(24);
      file.put<uint16_t>(0xffff);
      file.full_box("vpcC", kVersion1, [&] {
        constexpr uint8_t kBt601 = 6;
        file.put<uint8_t>(0);  // profile
        file.put(level_of(width_px_, height_px_, ticks_a_second_ / double(kTicksAFrame)));
        file.put<uint8_t>(8 << 4 | 1 << 1);  // 8 bits, 4:2:0 with colour on the upper left pixel, video range
        for (int i = 0; i < 3; ++i) file.put(kBt601);
        file.put<uint16_t>(0);
      });
    });
  };
  const auto sample_table = [&] {
    file.full_box("stsd", 0, [&] {
      file.put<uint32_t>(1);
      sample_entry();
    });
    file.full_box("stts", 0, [&] {
      file.put<uint32_t>(1);
      file.put(uint32_t(frame_bytes_.size()));
      file.put(kTicksAFrame);
    });
    file.full_box("stss", 0, [&] {
      file.put(uint32_t(key_frames_.size()));
      for (const uint32_t number : key_frames_) file.put(number);
    });
    file.full_box("stsc", 0, [&] {
      file.put(uint32_t(chunks_.size()));
      for (size_t i = 0; i < chunks_.size(); ++i) {
        file.put(uint32_t(i + 1));
        file.put(chunks_[i].frames);
        file.put<uint32_t>(1);
      }
    });
    file.full_box("stsz", 0, [&] {
      file.put<uint32_t>(0);
      file.put(uint32_t(frame_bytes_.size()));
      for (const uint32_t size : frame_bytes_) file.put(size);
    });
    file.full_box("co64", 0, [&] {
      file.put(uint32_t(chunks_.size()));
      for (const Chunk& chunk : chunks_) file.put(chunk.offset);
    });
  };
  const auto media = [&] {
    file.full_box("mdhd", kVersion1, [&] {
      times();
      file.put(ticks_a_second_);
      file.put(duration);
      file.put<uint16_t>(0x55c4);  // no language
      file.zeros(2);
    });
    file.full_box("hdlr", 0, [&] {
      file.zeros(4);
      file.text("vide", 4);
      file.zeros(12);
      file.text("video", 6);
    });
    file.box("minf", [&] {
      file.full_box("vmhd", 1, [&] { file.zeros(8); });
      file.box("dinf", [&] {
        file.full_box("dref", 0, [&] {
          file.put<uint32_t>(1);
          file.full_box("url ", 1, [] {});
        });
      });
      file.box("stbl", sample_table);
    });
  };
  file.box("moov", [&] {
    file.full_box("mvhd", kVersion1, [&] {
      times();
      file.put(ticks_a_second_);
      file.put(duration);
      file.put(kOne);           // speed
      file.put<uint16_t>(256);  // volume
      file.zeros(10);
      file.unit_matrix();
      file.zeros(24);
      file.put<uint32_t>(2);  // the next track
    });
    file.box("trak", [&] {
      file.full_box("tkhd", kVersion1 | 3, [&] {  // is played
        times();
        file.put<uint32_t>(1);
        file.zeros(4);
        file.put(duration);
        file.zeros(16);
        file.unit_matrix();
        file.put(uint32_t(width_px_) * kOne);
        file.put(uint32_t(height_px_) * kOne);
      });
      file.box("mdia", media);
    });
  });
  return file.bytes;
}

}  // namespace maq
