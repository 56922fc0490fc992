#include "image/files/origin_mark.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <iterator>

namespace maq {
namespace {

// In PNG's form of a text chunk: keyword, zero, text.
constexpr char kMark[] = "predicted\0maquette horizon_ns=";
constexpr size_t kMarkBytes = sizeof kMark - 1, kMaxMarkOffset = 64;
constexpr ptrdiff_t kEndOfPngHeader = 33, kEndOfJpegStart = 2;

// The checksum of PNG (ISO 3309).
uint32_t crc_of(const uint8_t* bytes, size_t count) {
  uint32_t crc = 0xffffffff;
  for (size_t i = 0; i < count; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xedb88320 : 0);
  }
  return ~crc;
}

void append_big_endian(uint32_t value, int bytes, std::vector<uint8_t>& to) {
  while (bytes-- > 0) to.push_back(uint8_t(value >> 8 * bytes));
}

}  // namespace

void mark_origin(const FrameOrigin& origin, const std::string& extension, std::vector<uint8_t>& encoded) {
  if (!origin.is_predicted) return;
  char numbers[128];
  const int length =
      std::snprintf(numbers, sizeof numbers, "%" PRId64 " captured_timestamp_ns=%" PRId64 " captured_sequence=%" PRIu64,
                    origin.horizon_ns, origin.captured_timestamp_ns, origin.captured_sequence);
  std::vector<uint8_t> text(kMark, kMark + kMarkBytes);
  text.insert(text.end(), numbers, numbers + length);
  std::vector<uint8_t> part;
  if (extension == ".png") {
    append_big_endian(uint32_t(text.size()), 4, part);
    for (const char c : {'t', 'E', 'X', 't'}) part.push_back(uint8_t(c));
    part.insert(part.end(), text.begin(), text.end());
    append_big_endian(crc_of(part.data() + 4, part.size() - 4), 4, part);
  } else {
    append_big_endian(0xfffe, 2, part);
    append_big_endian(uint32_t(text.size() + 2), 2, part);
    part.insert(part.end(), text.begin(), text.end());
  }
  encoded.insert(encoded.begin() + (extension == ".png" ? kEndOfPngHeader : kEndOfJpegStart), part.begin(), part.end());
}

FrameOrigin read_origin_mark(const EncodedBytes& encoded) {
  const uint8_t* const end = encoded.data + std::min(encoded.size, kMaxMarkOffset + kMarkBytes);
  const uint8_t* const mark = std::search(encoded.data, end, kMark, kMark + kMarkBytes);
  if (mark == end) return {};
  const uint8_t* const begin = mark + kMarkBytes;
  const std::string numbers(begin, begin + std::min<size_t>(128, size_t(encoded.data + encoded.size - begin)));
  FrameOrigin origin;
  origin.is_predicted = true;
  std::sscanf(numbers.c_str(), "%" SCNd64 " captured_timestamp_ns=%" SCNd64 " captured_sequence=%" SCNu64,
              &origin.horizon_ns, &origin.captured_timestamp_ns, &origin.captured_sequence);
  return origin;
}

}  // namespace maq
