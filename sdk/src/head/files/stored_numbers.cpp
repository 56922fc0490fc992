#include "head/files/stored_numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace maq::head {
namespace {

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
  // In units of the last digit of its power of two, or of the smallest half. A carry goes into the exponent.
  const int exponent = std::max(std::ilogb(magnitude), -14);
  const int units = int(std::nearbyint(std::ldexp(magnitude, 10 - exponent)));
  return uint16_t(sign | (((exponent + 14) << 10) + units));
}

void StoredBytes::floats(StoredFormat format, float* to, size_t count) {
  require_left(count, size_of(format));
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
  check_floats(to, count);
}

std::vector<float> StoredBytes::floats(StoredFormat format, size_t count) {
  require_left(count, size_of(format));
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

std::vector<NamedPoint> StoredBytes::landmarks(size_t count) {
  std::vector<NamedPoint> landmarks;
  for (size_t i = 0; i < count; ++i) {
    NamedPoint landmark;
    const size_t length = number<uint8_t>();
    landmark.name.assign(reinterpret_cast<const char*>(take(length)), length);
    floats(StoredFormat::kFloat32, landmark.template_point.data(), 3);
    landmarks.push_back(std::move(landmark));
  }
  return landmarks;
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

}  // namespace maq::head
