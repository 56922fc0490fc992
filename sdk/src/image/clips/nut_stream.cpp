#include "image/clips/nut_stream.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "core/frame.h"

namespace maq {
namespace {

constexpr char kFileId[] = "nut/multimedia container";  // with its final zero
enum Flag : uint64_t {
  kCodedPts = 8,
  kStreamId = 16,
  kSizeMsb = 32,
  kChecksum = 64,
  kReserved = 128,
  kSideData = 256,
  kHeaderIndex = 1024,
  kMatchTime = 2048,
  kCoded = 4096,
  kInvalid = 8192
};
constexpr size_t kBufferBytes = 64 << 10, kMaxPacketBytes = 1 << 20, kMaxElidedFrame = 4096;

}  // namespace

// The payload of a header, with numbers of 7 bits a byte; 0 after its end.
class NutStream::Packet {
 public:
  explicit Packet(const std::vector<uint8_t>& bytes) : bytes_(bytes) {}

  uint64_t number() {
    uint64_t value = 0;
    while (at_ < bytes_.size()) {
      const uint8_t byte = bytes_[at_++];
      value = value << 7 | (byte & 127);
      if ((byte & 128) == 0) break;
    }
    return value;
  }
  int64_t signed_number() {
    const uint64_t value = number() + 1;
    return (value & 1) != 0 ? -int64_t(value >> 1) : int64_t(value >> 1);
  }
  std::vector<uint8_t> text() {
    const uint64_t asked = number();
    const size_t size = size_t(std::min<uint64_t>(asked, bytes_.size() - at_));
    const auto begin = bytes_.begin() + ptrdiff_t(at_);
    at_ += size;
    return {begin, begin + ptrdiff_t(size)};
  }
  bool is_over() const { return at_ == bytes_.size(); }
  bool has_more() const { return at_ + 4 < bytes_.size(); }  // before the checksum

 private:
  const std::vector<uint8_t>& bytes_;
  size_t at_ = 0;
};

NutStream::NutStream(int fd) : fd_(fd), buffer_(kBufferBytes) {
  std::array<uint8_t, sizeof kFileId> id{};
  if (!read_bytes(id.data(), id.size()) || std::memcmp(id.data(), kFileId, id.size()) != 0) return;
  for (;;) {
    first_byte_ = next_byte();
    if (first_byte_ < 0) return;
    if (first_byte_ != 'N') break;
    if (!read_packet(next_byte())) return;
  }
  is_open_ = width_px_ > 0 && height_px_ > 0 && time_numerator_ > 0 && time_denominator_ > 0;
}

bool NutStream::fill() {
  ssize_t count = 0;
  do {
    count = ::read(fd_, buffer_.data(), buffer_.size());
  } while (count < 0 && errno == EINTR);
  at_ = 0;
  filled_ = size_t(std::max<ssize_t>(count, 0));
  is_broken_ |= filled_ == 0;
  return filled_ > 0;
}

int NutStream::next_byte() { return at_ == filled_ && !fill() ? -1 : buffer_[at_++]; }

bool NutStream::read_bytes(uint8_t* to, size_t count) {
  while (count > 0) {
    if (at_ == filled_ && count >= buffer_.size()) {  // straight to where it belongs
      const ssize_t read = ::read(fd_, to, count);
      if (read < 0 && errno == EINTR) continue;
      if (read <= 0) return false;
      to += read;
      count -= size_t(read);
      continue;
    }
    if (at_ == filled_ && !fill()) return false;
    const size_t part = std::min(count, filled_ - at_);
    std::memcpy(to, buffer_.data() + at_, part);
    at_ += part;
    to += part;
    count -= part;
  }
  return true;
}

uint64_t NutStream::number() {
  uint64_t value = 0;
  for (int byte = 128; (byte & 128) != 0;) {
    byte = next_byte();
    if (byte < 0) return 0;
    value = value << 7 | uint64_t(byte & 127);
  }
  return value;
}

// After the first byte of its start code. Returns false at the end.
bool NutStream::read_packet(int startcode) {
  std::array<uint8_t, 6> rest{};
  if (!read_bytes(rest.data(), rest.size())) return false;
  const uint64_t size = number();
  if (size > kMaxPacketBytes) return false;
  if (size > 4096 && !read_bytes(rest.data(), 4)) return false;
  std::vector<uint8_t> bytes(size);
  if (!read_bytes(bytes.data(), bytes.size())) return false;
  Packet packet(bytes);
  switch (startcode) {
    case 'M': read_main_header(packet); break;
    case 'S': read_stream_header(packet); break;
    case 'I': read_info(packet); break;
    case 'K': last_pts_ = int64_t(packet.number() / time_bases_); break;
    default: break;
  }
  return true;
}

void NutStream::read_main_header(Packet& packet) {
  if (packet.number() > 3) packet.number();  // version
  packet.number();                           // streams
  packet.number();                           // distance between synchronisation points
  time_bases_ = std::max<uint64_t>(packet.number(), 1);
  time_numerator_ = packet.number();
  time_denominator_ = packet.number();
  for (uint64_t i = 1; i < std::min<uint64_t>(time_bases_, 16); ++i) {
    packet.number();
    packet.number();
  }
  FrameCode code{};
  code.size_factor = 1;
  for (size_t i = 0; i < codes_.size();) {
    const uint64_t flags = packet.number(), fields = packet.number();
    if (fields > 0) code.pts_step = packet.signed_number();
    if (fields > 1) code.size_factor = packet.number();
    if (fields > 2) code.stream = packet.number();
    code.size_offset = fields > 3 ? packet.number() : 0;
    code.reserved = fields > 4 ? packet.number() : 0;
    uint64_t count = fields > 5 ? packet.number() : code.size_factor - code.size_offset;
    if (fields > 6) packet.signed_number();  // match time
    if (fields > 7) code.header = packet.number();
    for (uint64_t k = 8; k < std::min<uint64_t>(fields, 64); ++k) packet.number();
    code.flags = flags;
    if (packet.is_over() || count == 0) break;
    for (; count > 0 && i < codes_.size(); ++i) {
      codes_[i] = code;
      if (i == 'N') {
        codes_[i].flags = kInvalid;
        continue;
      }
      --count;
      ++code.size_offset;
    }
  }
  elided_.resize(1);
  if (!packet.has_more()) return;
  for (uint64_t left = std::min<uint64_t>(packet.number(), 128); left > 0; --left) elided_.push_back(packet.text());
}

void NutStream::read_stream_header(Packet& packet) {
  packet.number();  // id
  packet.number();  // class
  packet.text();    // kind of pixels, which is known
  packet.number();  // time base
  const uint64_t pts_bits = packet.number();
  packet.number();  // largest step of time
  packet.number();  // delay
  packet.number();  // flags
  packet.text();
  const uint64_t width = packet.number(), height = packet.number();
  if (width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX || width * height > MAQ_MAX_PIXELS || pts_bits > 15) return;
  pts_bits_ = pts_bits;
  width_px_ = int(width);
  height_px_ = int(height);
}

// Takes the rate from "r_frame_rate", as "30000/1001"; other infos are skipped.
void NutStream::read_info(Packet& packet) {
  packet.number();         // stream
  packet.signed_number();  // chapter
  packet.number();
  packet.number();
  for (uint64_t left = std::min<uint64_t>(packet.number(), 256); left > 0; --left) {
    const std::vector<uint8_t> name = packet.text();
    const int64_t type = packet.signed_number();
    if (type == -1 || type == -2) {  // a text; -2 has its kind before
      if (type == -2) packet.text();
      const std::vector<uint8_t> value = packet.text();
      const std::string text(value.begin(), value.end());
      const size_t slash = text.find('/');
      if (std::string(name.begin(), name.end()) != "r_frame_rate" || slash == std::string::npos) continue;
      const double frames = std::strtod(text.c_str(), nullptr),
                   seconds = std::strtod(text.c_str() + slash + 1, nullptr);
      fps_ = seconds > 0 ? frames / seconds : 0;
    } else if (type == -3) {
      packet.signed_number();
    } else if (type == -4) {
      packet.number();
    } else if (type < -4) {
      packet.signed_number();
    }
  }
}

int64_t NutStream::pts_of(uint64_t coded) const {
  const uint64_t period = uint64_t(1) << pts_bits_;
  if (coded >= period) return int64_t(coded - period);
  // The low bits of the time next to the last.
  const uint64_t mask = period - 1, near = uint64_t(last_pts_) - mask / 2;
  return int64_t(((coded - near) & mask) + near);
}

bool NutStream::read(std::vector<uint8_t>& pixels, int64_t& time_ns) {
  if (!is_open_ || is_broken_) return false;
  is_broken_ = true;
  if (first_byte_ < 0) first_byte_ = next_byte();
  while (first_byte_ == 'N') {
    if (!read_packet(next_byte())) return false;
    first_byte_ = next_byte();
  }
  if (first_byte_ < 0) return false;
  FrameCode code = codes_[size_t(std::exchange(first_byte_, -1))];
  if ((code.flags & kInvalid) != 0) return false;
  if ((code.flags & kCoded) != 0) code.flags ^= number();
  if ((code.flags & kStreamId) != 0) code.stream = number();
  last_pts_ = (code.flags & kCodedPts) != 0 ? pts_of(number()) : int64_t(uint64_t(last_pts_) + uint64_t(code.pts_step));
  uint64_t size = code.size_offset;
  if ((code.flags & kSizeMsb) != 0) size += code.size_factor * number();
  if ((code.flags & kMatchTime) != 0) number();
  if ((code.flags & kHeaderIndex) != 0) code.header = number();
  if ((code.flags & kReserved) != 0) code.reserved = number();
  for (uint64_t i = 0; i < std::min<uint64_t>(code.reserved, 64); ++i) number();
  std::array<uint8_t, 4> checksum{};
  if ((code.flags & kChecksum) != 0 && !read_bytes(checksum.data(), checksum.size())) return false;
  const size_t expected = size_t(width_px_) * size_t(height_px_) * 3;
  if (size != expected || (code.flags & kSideData) != 0 || code.header >= elided_.size()) return false;
  pixels.resize(expected);
  const std::vector<uint8_t>& begin = elided_[size > kMaxElidedFrame ? 0 : code.header];
  if (begin.size() > size) return false;
  std::copy(begin.begin(), begin.end(), pixels.begin());
  if (!read_bytes(pixels.data() + begin.size(), pixels.size() - begin.size())) return false;
  const double time = double(last_pts_) * double(time_numerator_) / double(time_denominator_) * 1e9;
  if (!(std::abs(time) < 9e18)) return false;  // no such number of nanoseconds
  time_ns = std::llround(time);
  is_broken_ = false;
  return true;
}

}  // namespace maq
