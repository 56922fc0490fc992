#include "image/files/tiff.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "core/error.h"

namespace maq {
namespace {

enum Tag : uint16_t {
  kWidth = 256,
  kHeight = 257,
  kBits = 258,
  kCompression = 259,
  kPhotometric = 262,
  kFillOrder = 266,
  kStripOffsets = 273,
  kSamples = 277,
  kRowsPerStrip = 278,
  kStripBytes = 279,
  kPlanarConfiguration = 284,
  kPredictor = 317,
  kPalette = 320,
  kTileWidth = 322,
  kTileHeight = 323,
  kTileOffsets = 324,
  kTileBytes = 325,
  kSampleFormat = 339,
};
enum Photometric : uint32_t { kWhiteIsZero = 0, kBlackIsZero = 1, kRgb = 2, kIndexed = 3 };
enum Compression : uint32_t { kNone = 1, kLzw = 5, kDeflate = 8, kPackBits = 32773, kOldDeflate = 32946 };
enum Predictor : uint32_t { kNoPredictor = 1, kDifferences = 2, kFloatDifferences = 3 };

constexpr uint32_t kUnsigned = 1, kFloat = 3;  // sample formats
constexpr uint16_t kShort = 3, kLong = 4;      // types of entries

// A damaged file, to decode().
struct Damage {};

[[noreturn]] void refuse(const char* kind, uint32_t value) {
  throw Error(MAQ_ERROR_UNSUPPORTED, "A TIFF image of this kind (", kind, ' ', value, ") is not read; save it as PNG.");
}

// The numbers of the first directory.
class Directory {
 public:
  explicit Directory(const EncodedBytes& bytes) : bytes_(bytes) {
    if (bytes.size < 8) throw Damage();
    is_big_endian = bytes.data[0] == 'M';
    first_ = number(4, 4);
    entries_ = number(first_, 2);
  }

  // Empty where there is none.
  std::vector<uint32_t> values(Tag tag) const {
    for (size_t i = 0; i < entries_; ++i) {
      const size_t entry = first_ + 2 + 12 * i;
      if (number(entry, 2) != tag) continue;
      const uint32_t type = number(entry + 2, 2), count = number(entry + 4, 4);
      const size_t size = type == kShort ? 2 : type == kLong ? 4 : 1;
      if (count > bytes_.size / size) throw Damage();
      const size_t at = count * size <= 4 ? entry + 8 : number(entry + 8, 4);
      std::vector<uint32_t> found(count);
      for (size_t k = 0; k < count; ++k) found[k] = number(at + k * size, size);
      return found;
    }
    return {};
  }
  uint32_t value(Tag tag, uint32_t missing) const {
    const std::vector<uint32_t> found = values(tag);
    return found.empty() ? missing : found[0];
  }

  bool is_big_endian = false;

 private:
  uint32_t number(size_t at, size_t size) const {
    if (at > bytes_.size || size > bytes_.size - at) throw Damage();
    uint32_t value = 0;
    for (size_t i = 0; i < size; ++i) value |= uint32_t(bytes_.data[at + i]) << 8 * (is_big_endian ? size - 1 - i : i);
    return value;
  }

  const EncodedBytes& bytes_;
  size_t first_ = 0, entries_ = 0;
};

// Decoders fill `out`, and throw for data that ends before.

void unpack_bits(const uint8_t* in, size_t size, std::vector<uint8_t>& out) {
  size_t at = 0, to = 0;
  while (to < out.size()) {
    if (at + 1 >= size) throw Damage();
    const size_t head = in[at++];  // a signed byte
    if (head == 128) continue;
    const bool repeats = head > 128;
    const size_t count = repeats ? 257 - head : head + 1, taken = repeats ? 1 : count;
    if (count > out.size() - to || taken > size - at) throw Damage();
    if (repeats) {
      std::fill_n(out.begin() + ptrdiff_t(to), count, in[at]);
    } else {
      std::copy_n(in + at, count, out.begin() + ptrdiff_t(to));
    }
    at += taken;
    to += count;
  }
}

void inflate_all(const uint8_t* in, size_t size, std::vector<uint8_t>& out) {
  uLongf to = uLongf(out.size());
  const int status = uncompress(out.data(), &to, in, uLong(size));
  if (status == Z_MEM_ERROR) throw std::bad_alloc();
  if ((status != Z_OK && status != Z_BUF_ERROR) || to != out.size()) throw Damage();
}

constexpr uint32_t kClearCode = 256, kEndCode = 257, kFirstCode = 258, kMaxCodes = 4096;

// Codes of 9 to 12 bits, the highest bit first; they grow one code early (TIFF 6.0, section 13).
void decode_lzw(const uint8_t* in, size_t size, std::vector<uint8_t>& out) {
  // Each code is a text that was written before: its end in `out`, and its length.
  std::vector<std::pair<size_t, uint32_t>> texts(kMaxCodes);
  uint32_t next = kFirstCode, bits = 9, held_bits = 0;
  uint64_t held = 0;
  size_t at = 0, to = 0;
  std::pair<size_t, uint32_t> before{0, 0};
  while (to < out.size()) {
    for (; held_bits < bits; held_bits += 8) {
      if (at == size) throw Damage();
      held = held << 8 | in[at++];
    }
    held_bits -= bits;
    const uint32_t code = uint32_t(held >> held_bits) & ((1u << bits) - 1);
    if (code == kEndCode) throw Damage();
    if (code == kClearCode) {
      next = kFirstCode;
      bits = 9;
      before.second = 0;
      continue;
    }
    if (code > kEndCode && (code > next || (code == next && before.second == 0))) throw Damage();
    const size_t begin = to;
    if (code < kClearCode) {
      out[to++] = uint8_t(code);
    } else {
      // The newest code is the text before and its first letter.
      const auto [end, length] = code == next ? std::pair(before.first, before.second + 1) : texts[code];
      if (length > out.size() - to) throw Damage();
      const size_t from = code == next ? before.first - before.second : end - length;
      for (uint32_t i = 0; i < length; ++i) out[to++] = out[from + i];
    }
    if (before.second > 0 && next < kMaxCodes) texts[next++] = {begin + 1, before.second + 1};
    before = {to, uint32_t(to - begin)};
    if (next + 1 >= (1u << bits) && bits < 12) ++bits;
  }
}

// The pixels as the directory describes them, and their decoding.
class TiffReader {
 public:
  explicit TiffReader(const EncodedBytes& bytes) : bytes_(bytes), directory_(bytes) {
    width = directory_.value(kWidth, 0);
    height = directory_.value(kHeight, 0);
    if (width < 1 || height < 1 || width > MAQ_MAX_SIDE_PX || height > MAQ_MAX_SIDE_PX) throw Damage();
    if (width * height > MAQ_MAX_PIXELS) throw Damage();
    bits = directory_.value(kBits, 1);
    samples = directory_.value(kSamples, 1);
    format = directory_.value(kSampleFormat, kUnsigned);
    photometric = directory_.value(kPhotometric, kBlackIsZero);
  }

  bool is_grey() const { return samples == 1 && (photometric == kWhiteIsZero || photometric == kBlackIsZero); }
  std::vector<uint32_t> palette() const { return directory_.values(kPalette); }

  // Calls use(x, y, samples, count) for each row of each strip or tile; samples have the byte order of this machine.
  template <class Use>
  void read(const Use& use) const {
    if (samples < 1 || samples > 8) refuse("samples a pixel", samples);
    if (directory_.value(kPlanarConfiguration, 1) != 1 && samples > 1) refuse("planar configuration", 2);
    if (directory_.value(kFillOrder, 1) != 1) refuse("fill order", 2);
    const bool has_tiles = !directory_.values(kTileOffsets).empty();
    const uint64_t block_width = has_tiles ? directory_.value(kTileWidth, 0) : width;
    uint64_t block_height = directory_.value(has_tiles ? kTileHeight : kRowsPerStrip, uint32_t(height));
    if (!has_tiles) block_height = std::min<uint64_t>(block_height, uint64_t(height));
    if (block_width < 1 || block_height < 1 || block_width > 65536 || block_height > 65536) throw Damage();
    const std::vector<uint32_t> offsets = directory_.values(has_tiles ? kTileOffsets : kStripOffsets);
    const std::vector<uint32_t> sizes = directory_.values(has_tiles ? kTileBytes : kStripBytes);
    const size_t across = size_t((uint64_t(width) + block_width - 1) / block_width);
    const size_t down = size_t((uint64_t(height) + block_height - 1) / block_height);
    if (offsets.size() < across * down || sizes.size() < across * down) throw Damage();
    const size_t row_bytes = size_t(block_width) * samples * (bits / 8);
    if (row_bytes * block_height > (size_t(1) << 30)) throw Damage();
    std::vector<uint8_t> block;
    for (size_t i = 0; i < across * down; ++i) {
      const int64_t x = int64_t(i % across * block_width), y = int64_t(i / across * block_height);
      const size_t rows = has_tiles ? block_height : size_t(std::min<int64_t>(int64_t(block_height), height - y));
      block.resize(rows * row_bytes);
      decode(offsets[i], sizes[i], block);
      for (size_t r = 0; r < rows && y + int64_t(r) < height; ++r) {
        uint8_t* row = block.data() + r * row_bytes;
        prepare(row, size_t(block_width));
        use(int(x), int(y + int64_t(r)), row, int(std::min<int64_t>(int64_t(block_width), width - x)));
      }
    }
  }

  int64_t width = 0, height = 0;
  uint32_t bits = 0, samples = 0, format = 0, photometric = 0;

 private:
  void decode(uint32_t offset, uint32_t size, std::vector<uint8_t>& block) const {
    if (offset > bytes_.size || size > bytes_.size - offset) throw Damage();
    const uint8_t* in = bytes_.data + offset;
    const uint32_t compression = directory_.value(kCompression, kNone);
    switch (compression) {
      case kNone:
        if (size < block.size()) throw Damage();
        std::copy_n(in, block.size(), block.begin());
        break;
      case kLzw: decode_lzw(in, size, block); break;
      case kDeflate:
      case kOldDeflate: inflate_all(in, size, block); break;
      case kPackBits: unpack_bits(in, size, block); break;
      default: refuse("compression", compression);
    }
  }

  template <class Number>
  void add_differences(uint8_t* row, size_t count) const {
    auto* values = reinterpret_cast<Number*>(row);
    for (size_t i = samples; i < count; ++i) values[i] = Number(values[i] + values[i - samples]);
  }

  // Undoes the predictor, and swaps bytes.
  void prepare(uint8_t* row, size_t pixels) const {
    const size_t count = pixels * samples, size = bits / 8;
    const uint32_t predictor = directory_.value(kPredictor, kNoPredictor);
    if (predictor == kFloatDifferences) {  // the bytes of all values, the highest first (Adobe, TIFF technical note 3)
      if (size != 4) refuse("predictor", predictor);
      add_differences<uint8_t>(row, count * size);
      const std::vector<uint8_t> bytes(row, row + count * size);
      for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < size; ++k) row[i * size + k] = bytes[(size - 1 - k) * count + i];
      }
      return;
    }
    if (directory_.is_big_endian && size > 1) {
      for (size_t i = 0; i < count; ++i) std::reverse(row + i * size, row + (i + 1) * size);
    }
    if (predictor == kNoPredictor) return;
    if (predictor != kDifferences) refuse("predictor", predictor);
    if (size == 1) add_differences<uint8_t>(row, count);
    if (size == 2) add_differences<uint16_t>(row, count);
    if (size == 4) add_differences<uint32_t>(row, count);
  }

  const EncodedBytes& bytes_;
  const Directory directory_;
};

DecodedImage read_colours(const TiffReader& reader) {
  if (reader.bits != 8 && reader.bits != 16) refuse("bits a sample", reader.bits);
  if (reader.format != kUnsigned) refuse("sample format", reader.format);
  if (reader.photometric > kIndexed) refuse("photometric interpretation", reader.photometric);
  if (reader.photometric == kRgb && reader.samples < 3) throw Damage();
  const std::vector<uint32_t> palette = reader.palette();
  const size_t colours = size_t(1) << reader.bits;
  if (reader.photometric == kIndexed && palette.size() < 3 * colours) throw Damage();
  NewImage image(MAQ_PIXEL_BGR8, int(reader.width), int(reader.height));
  const size_t size = reader.bits / 8;
  // Rounded as libtiff does.
  const auto byte_of = [&](const uint8_t* value) {
    return size == 1 ? *value : uint8_t((uint32_t(value[0] | value[1] << 8) + 128) / 257);
  };
  reader.read([&](int x, int y, const uint8_t* from, int count) {
    uint8_t* to = image.row(y) + 3 * x;
    for (int i = 0; i < count; ++i, from += reader.samples * size, to += 3) {
      for (size_t c = 0; c < 3; ++c) {
        if (reader.photometric == kRgb) {
          to[2 - c] = byte_of(from + c * size);
        } else if (reader.photometric == kIndexed) {
          const size_t index = size == 1 ? from[0] : size_t(from[0] | from[1] << 8);
          to[2 - c] = uint8_t(palette[c * colours + index] * 255 / 65535);
        } else {
          to[c] = reader.photometric == kWhiteIsZero ? uint8_t(255 - byte_of(from)) : byte_of(from);
        }
      }
    }
  });
  return std::move(image);
}

DecodedImage read_depth(const TiffReader& reader) {
  const bool is_float = reader.format == kFloat && reader.bits == 32;
  const maq_pixel_format format = is_float ? MAQ_PIXEL_DEPTH32F : MAQ_PIXEL_DEPTH16;
  if (!reader.is_grey() || (!is_float && (reader.bits != 16 || reader.format != kUnsigned))) {
    return {{format, int(reader.width), int(reader.height), {}}, nullptr};
  }
  NewImage image(format, int(reader.width), int(reader.height));
  const size_t size = reader.bits / 8;
  reader.read([&](int x, int y, const uint8_t* from, int count) {
    std::copy_n(from, size_t(count) * size, image.row(y) + size_t(x) * size);
  });
  return std::move(image);
}

template <class Read>
DecodedImage decode(const EncodedBytes& bytes, const Read& read) {
  try {
    return read(TiffReader(bytes));
  } catch (const Damage&) {
    return {};
  }
}

}  // namespace

DecodedImage decode_tiff(const EncodedBytes& bytes) { return decode(bytes, read_colours); }

DecodedImage decode_depth_tiff(const EncodedBytes& bytes) { return decode(bytes, read_depth); }

std::vector<uint8_t> encode_depth_tiff(const ImageView& depth) {
  const uint32_t width = uint32_t(depth.width_px), height = uint32_t(depth.height_px);
  const size_t row_bytes = size_t(width) * sizeof(float);
  std::vector<uint8_t> rows(row_bytes * height);
  copy_packed(depth, rows.data());
  std::vector<uint8_t> bytes = {'I', 'I', 42, 0, 8, 0, 0, 0};
  const auto put = [&](uint64_t value, size_t size) {
    for (size_t i = 0; i < size; ++i) bytes.push_back(uint8_t(value >> 8 * i));
  };
  uLongf packed = compressBound(uLong(rows.size()));
  std::vector<uint8_t> pixels(packed);
  if (compress2(pixels.data(), &packed, rows.data(), uLong(rows.size()), Z_BEST_SPEED) != Z_OK) throw std::bad_alloc();
  const std::pair<Tag, uint32_t> entries[] = {{kWidth, width},
                                              {kHeight, height},
                                              {kBits, 32},
                                              {kCompression, kDeflate},
                                              {kPhotometric, kBlackIsZero},
                                              {kStripOffsets, 0},
                                              {kSamples, 1},
                                              {kRowsPerStrip, height},
                                              {kStripBytes, uint32_t(packed)},
                                              {kPlanarConfiguration, 1},
                                              {kSampleFormat, kFloat}};
  constexpr size_t kEntries = std::size(entries), kPixels = 8 + 2 + 12 * kEntries + 4;
  put(kEntries, 2);
  for (const auto& [tag, value] : entries) {
    const bool is_long =
        tag == kWidth || tag == kHeight || (tag >= kStripOffsets && tag != kSamples && tag <= kStripBytes);
    put(tag, 2);
    put(is_long ? kLong : kShort, 2);
    put(1, 4);
    put(tag == kStripOffsets ? kPixels : value, 4);
  }
  put(0, 4);  // no other image
  bytes.insert(bytes.end(), pixels.begin(), pixels.begin() + ptrdiff_t(packed));
  return bytes;
}

}  // namespace maq
