// Numbers of a file's bytes, from front to back, checked; and bytes that are made of numbers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "core/error.h"
#include "head/field/field_weights.h"
#include "head/files/file_format.h"
#include "head/head_prior.h"

namespace maq::head {

// IEEE 754 binary16; to the nearest, ties to even, infinite beyond 65504.
float half_to_float(uint16_t half);
uint16_t float_to_half(float value);

class StoredBytes {
 public:
  // `name` begins each sentence: "prior.maqp". `damage`: the status of what cannot be used. The bytes stay the
  // caller's.
  StoredBytes(const void* bytes, size_t count, std::string name, maq_status damage)
      : bytes_(static_cast<const uint8_t*>(bytes)), left_(count), name_(std::move(name)), damage_(damage) {}

  // Reads a head, and checks the start of the file and its checksum. `kind`: "a prior of heads (.maqp)". `remedy`: what
  // to do about another version. Throws `damage`, and MAQ_ERROR_UNSUPPORTED for another version.
  template <class Head>
  Head head(const char (&magic)[8], uint32_t version, const char* kind, const char* remedy) {
    check_start(magic, version, sizeof(Head), kind, remedy);
    return number<Head>();
  }

  size_t left() const { return left_; }

  // All of these throw `damage` when the bytes end before.
  template <class Number>
  Number number() {
    Number number;
    std::memcpy(&number, take(sizeof number), sizeof number);
    return number;
  }
  void floats(StoredFormat format, float* to, size_t count);  // of kFloat32 or kFloat16
  std::vector<float> floats(StoredFormat format, size_t count);
  // The weights and biases of one layer of some heads, in order.
  void layers(StoredFormat format, const std::vector<FieldLayer>& of_codes);
  std::vector<NamedPoint> places(size_t count);
  std::vector<uint8_t> bytes(size_t count);

  // Throws unless everything was read.
  void end() const;

  template <class... Parts>
  [[noreturn]] void fail(const Parts&... parts) const {
    throw Error(damage_, name_, parts...);
  }

 private:
  void check_start(const char (&magic)[8], uint32_t version, size_t head_bytes, const char* kind,
                   const char* remedy) const;
  const uint8_t* take(size_t count);

  const uint8_t* bytes_;
  size_t left_;
  std::string name_;
  maq_status damage_;
};

// Throws the reader's damage for what no shape has, MAQ_ERROR_UNSUPPORTED as check_field_shape() does.
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
  void finish(size_t head_bytes, const char (&magic)[8], uint32_t version);
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
};

}  // namespace maq::head
