#include "scene/splats/files/gzip_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <limits>

namespace maq {
namespace {

constexpr int kGzipWindow = 15 + 16;  // the largest window; a gzip header instead of zlib's
constexpr uint64_t kMaxDeflateRatio = 1032;

}  // namespace

struct GzipFile::Inflation {
  Inflation() {
    if (inflateInit2(&stream, kGzipWindow) != Z_OK) throw std::bad_alloc();
  }
  ~Inflation() { inflateEnd(&stream); }
  Inflation(const Inflation&) = delete;
  Inflation& operator=(const Inflation&) = delete;

  z_stream stream{};
  std::array<uint8_t, 1 << 15> input{};
};

GzipFile::GzipFile(const std::string& path)
    : file_(path), max_bytes_(file_.remaining() * kMaxDeflateRatio), inflation_(std::make_unique<Inflation>()) {}

GzipFile::~GzipFile() = default;

void GzipFile::read(void* bytes, size_t count) {
  z_stream& stream = inflation_->stream;
  auto* to = static_cast<uint8_t*>(bytes);
  while (count > 0) {
    if (stream.avail_in == 0) {
      const auto part = size_t(std::min<uint64_t>(inflation_->input.size(), file_.remaining()));
      file_.read(inflation_->input.data(), part);
      stream.next_in = inflation_->input.data();
      stream.avail_in = uInt(part);
    }
    const auto wanted = uInt(std::min<size_t>(count, std::numeric_limits<uInt>::max()));
    stream.next_out = to;
    stream.avail_out = wanted;
    const int result = inflate(&stream, Z_NO_FLUSH);
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    const size_t made = wanted - stream.avail_out;
    to += made;
    count -= made;
    if (count == 0) return;
    if (result == Z_STREAM_END || (result == Z_BUF_ERROR && file_.remaining() == 0)) {
      file_.fail(" ends early: it is truncated or damaged; copy it again.");
    }
    if (result != Z_OK && result != Z_BUF_ERROR) {
      file_.fail(" cannot be decompressed: it is damaged; copy it again.");
    }
  }
}

std::vector<uint8_t> gzip_of(const std::vector<uint8_t>& bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, 9, Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
  std::vector<uint8_t> made;
  std::array<uint8_t, 1 << 15> part;
  size_t done = 0;
  int result = Z_OK;
  while (result == Z_OK) {
    if (stream.avail_in == 0 && done < bytes.size()) {
      stream.next_in = const_cast<Bytef*>(bytes.data() + done);  // zlib does not write there
      stream.avail_in = uInt(std::min<size_t>(bytes.size() - done, std::numeric_limits<uInt>::max()));
      done += stream.avail_in;
    }
    stream.next_out = part.data();
    stream.avail_out = uInt(part.size());
    result = deflate(&stream, done == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    made.insert(made.end(), part.begin(), part.end() - std::ptrdiff_t(stream.avail_out));
  }
  deflateEnd(&stream);
  if (result != Z_STREAM_END) throw std::bad_alloc();
  return made;
}

}  // namespace maq
