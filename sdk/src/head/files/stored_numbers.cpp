#include "head/files/stored_numbers.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq::head {
namespace {

// Larger ones come of no training, and products of some of them are not finite.
constexpr float kMaxStoredNumber = 1e6f;

size_t size_of(StoredFormat format) { return format == StoredFormat::kFloat16 ? sizeof(uint16_t) : sizeof(float); }

}  // namespace

float half_to_float(uint16_t half) {
  const int exponent = half >> 10 & 31, fraction = half & 1023;
  const float magnitude = exponent == 31  ? (fraction == 0 ? std::numeric_limits<float>::infinity()
                                                           : std::numeric_limits<float>::quiet_NaN())
                          : exponent == 0 ? std::ldexp(float(fraction), -24)
                                          : std::ldexp(float(1024 + fraction), exponent - 25);
  return half >> 15 != 0 ? -magnitude : magnitude;
}

uint16_t float_to_half(float value) {
  const uint16_t sign = std::signbit(value) ? 0x8000 : 0;
  const float magnitude = std::abs(value);
  if (std::isnan(value)) return uint16_t(sign | 0x7e00);
  if (magnitude >= 65520) return uint16_t(sign | 0x7c00);
  if (magnitude == 0) return sign;
  // In units of the last place of its power of two, or of the smallest half. A carry goes into the exponent.
  const int exponent = std::max(std::ilogb(magnitude), -14);
  const int units = int(std::nearbyint(std::ldexp(magnitude, 10 - exponent)));
  return uint16_t(sign | (((exponent + 14) << 10) + units));
}

void StoredBytes::check_start(const char (&magic)[8], uint32_t version, size_t head_bytes, const char* kind,
                              const char* remedy) const {
  FileStart start;
  if (left_ < head_bytes) fail(" is too short to be ", kind, ": ", left_, " bytes.");
  std::memcpy(&start, bytes_, sizeof start);
  if (std::memcmp(start.magic, magic, sizeof start.magic) != 0) fail(" is not ", kind, ".");
  if (start.version != version) {
    throw Error(MAQ_ERROR_UNSUPPORTED, name_, " is ", kind, " of version ", start.version, "; this SDK reads version ",
                version, ". ", remedy);
  }
  if (start.file_bytes != left_) {
    fail(" has ", left_, " bytes, but should have ", start.file_bytes, ": it is truncated or damaged; copy it again.");
  }
  if (start.head_bytes != head_bytes || start.check != XXH3_64bits(bytes_ + kCheckedFrom, left_ - kCheckedFrom)) {
    fail(" is damaged; copy it again.");
  }
}

const uint8_t* StoredBytes::take(size_t count) {
  if (count > left_) fail(" ends before what its head claims.");
  const uint8_t* const taken = bytes_;
  bytes_ += count;
  left_ -= count;
  return taken;
}

void StoredBytes::floats(StoredFormat format, float* to, size_t count) {
  if (count > left_ / size_of(format)) fail(" ends before what its head claims.");
  const uint8_t* const from = take(count * size_of(format));
  if (format == StoredFormat::kFloat16) {
    for (size_t i = 0; i < count; ++i) {
      uint16_t half;
      std::memcpy(&half, from + i * sizeof half, sizeof half);
      to[i] = half_to_float(half);
    }
  } else if (count > 0) {
    std::memcpy(to, from, count * sizeof(float));
  }
  // False for NaN.
  if (!std::all_of(to, to + count, [](float value) { return std::abs(value) <= kMaxStoredNumber; })) {
    fail(" has numbers that are not finite, or too large; make it again.");
  }
}

std::vector<float> StoredBytes::floats(StoredFormat format, size_t count) {
  if (count > left_ / size_of(format)) fail(" ends before what its head claims.");
  std::vector<float> values(count);
  floats(format, values.data(), count);
  return values;
}

void StoredBytes::layers(StoredFormat format, const std::vector<FieldLayer>& of_codes) {
  if (of_codes.empty()) return;
  const size_t outputs = size_t(of_codes[0].outputs), inputs = size_t(of_codes[0].inputs);
  const bool is_int8 = format == StoredFormat::kInt8;
  std::vector<float> scales;
  if (is_int8) scales = floats(StoredFormat::kFloat32, of_codes.size() * outputs);
  for (size_t code = 0; code < of_codes.size(); ++code) {
    for (size_t output = 0; output < outputs; ++output) {
      float* const row = of_codes[code].row(int(output));
      if (!is_int8) {
        floats(format, row, inputs);
        continue;
      }
      const uint8_t* const steps = take(inputs);
      const float scale = scales[code * outputs + output];
      for (size_t i = 0; i < inputs; ++i) row[i] = float(int8_t(steps[i])) * scale;
    }
  }
  for (const FieldLayer& layer : of_codes) floats(is_int8 ? StoredFormat::kFloat16 : format, layer.bias, outputs);
}

std::vector<uint8_t> StoredBytes::bytes(size_t count) {
  const uint8_t* const from = take(count);
  return {from, from + count};
}

std::vector<NamedPoint> StoredBytes::places(size_t count) {
  std::vector<NamedPoint> places;
  for (size_t i = 0; i < count; ++i) {
    NamedPoint place;
    const size_t length = number<uint8_t>();
    place.name.assign(reinterpret_cast<const char*>(take(length)), length);
    floats(StoredFormat::kFloat32, place.template_point.data(), 3);
    places.push_back(std::move(place));
  }
  return places;
}

void StoredBytes::end() const {
  if (left_ > 0) fail(" has ", left_, " bytes that belong to nothing.");
}

FieldShape checked_shape(const StoredShape& stored, const StoredBytes& bytes) {
  const auto size = [&](uint32_t value) {
    if (value > 65535) bytes.fail(" claims a field of a size that cannot be: ", value, ".");
    return int(value);
  };
  FieldShape shape;
  shape.octaves = size(stored.octaves);
  shape.width = size(stored.width);
  shape.geometry_layers = size(stored.geometry_layers);
  shape.feature = size(stored.feature);
  shape.surface_width = size(stored.surface_width);
  shape.surface_layers = size(stored.surface_layers);
  shape.personal_geometry_layers = size(stored.personal_geometry_layers);
  shape.personal_surface_layers = size(stored.personal_surface_layers);
  shape.smoothing = stored.smoothing;
  check_field_shape(shape);
  return shape;
}

StoredShape stored_shape(const FieldShape& shape) {
  return {uint32_t(shape.octaves),
          uint32_t(shape.width),
          uint32_t(shape.geometry_layers),
          uint32_t(shape.feature),
          uint32_t(shape.surface_width),
          uint32_t(shape.surface_layers),
          uint32_t(shape.personal_geometry_layers),
          uint32_t(shape.personal_surface_layers),
          shape.smoothing};
}

uint64_t stored_layer_bytes(const FieldShape& shape, int layer, StoredFormat format, int codes) {
  const uint64_t outputs = uint64_t(shape.outputs(layer)), inputs = uint64_t(shape.inputs(layer));
  const uint64_t of_one = format == StoredFormat::kInt8 ? outputs * (sizeof(float) + inputs + sizeof(uint16_t))
                                                        : outputs * (inputs + 1) * size_of(format);
  return uint64_t(codes) * of_one;
}

void BytesWriter::floats(StoredFormat format, const float* values, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    if (format == StoredFormat::kFloat16) {
      number(float_to_half(values[i]));
    } else {
      number(values[i]);
    }
  }
}

void BytesWriter::layer(StoredFormat format, const ConstFieldLayer& layer) {
  for (int output = 0; output < layer.outputs; ++output) floats(format, layer.row(output), size_t(layer.inputs));
  floats(format, layer.bias, size_t(layer.outputs));
}

void BytesWriter::finish(size_t head_bytes, const char (&magic)[8], uint32_t version) {
  FileStart start{};
  std::memcpy(start.magic, magic, sizeof start.magic);
  start.version = version;
  start.head_bytes = uint32_t(head_bytes);
  start.file_bytes = bytes_.size();
  std::memcpy(bytes_.data(), &start, sizeof start);
  start.check = XXH3_64bits(bytes_.data() + kCheckedFrom, bytes_.size() - kCheckedFrom);
  std::memcpy(bytes_.data(), &start, sizeof start);
}

}  // namespace maq::head
