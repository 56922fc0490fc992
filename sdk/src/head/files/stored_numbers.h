// Numbers of a file's bytes, from front to back, checked; and bytes that are made of numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "core/files/checked_bytes.h"
#include "head/field/field_weights.h"
#include "head/files/file_format.h"
#include "head/head_prior.h"

namespace maq::head {

// IEEE 754 binary16; to the nearest, ties to even, infinite beyond 65504.
float half_to_float(uint16_t half);
uint16_t float_to_half(float value);

class StoredBytes : public CheckedBytes {
 public:
  using CheckedBytes::CheckedBytes;
  using CheckedBytes::floats;

  // All of these throw like the functions of CheckedBytes.
  void floats(StoredFormat format, float* to, size_t count);  // of kFloat32 or kFloat16
  std::vector<float> floats(StoredFormat format, size_t count);
  // The weights and biases of one layer of some heads, in order.
  void layers(StoredFormat format, const std::vector<FieldLayer>& of_codes);
  std::vector<NamedPoint> landmarks(size_t count);
};

// Throws the reader's damage for impossible shapes, MAQ_ERROR_UNSUPPORTED as check_field_shape() does.
FieldShape checked_shape(const StoredShape& stored, const StoredBytes& bytes);
StoredShape stored_shape(const FieldShape& shape);

// Bytes that a layer takes, of so many codes (1: the layer itself).
uint64_t stored_layer_bytes(const FieldShape& shape, int layer, StoredFormat format, int codes);

// Appends to a file's bytes.
class BytesWriter {
 public:
  template <class Number>
  void number(const Number& number) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&number);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof number);
  }
  void bytes(const std::vector<uint8_t>& bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void text(const std::string& text) { bytes_.insert(bytes_.end(), text.begin(), text.end()); }
  void floats(StoredFormat format, const float* values, size_t count);
  void layer(StoredFormat format, const ConstFieldLayer& layer);

  // Makes the start of the file, whose head was written first, say how long all is, and its check.
  void finish(size_t head_bytes, const char (&magic)[8], uint32_t version) {
    sign_file(bytes_, head_bytes, magic, version);
  }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
};

}  // namespace maq::head
