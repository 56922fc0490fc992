#include "nn/portable/onnx_model.h"

#include <cstring>
#include <functional>
#include <utility>

#include "core/error.h"

namespace maq {
namespace {

size_t bytes_of(OnnxType type) {
  switch (type) {
    case OnnxType::kUint8:
    case OnnxType::kInt8: return 1;
    case OnnxType::kFloat:
    case OnnxType::kInt32: return 4;
    case OnnxType::kInt64: return 8;
  }
  return 0;
}

// Bytes of a protobuf message, read forward.
struct Bytes {
  const uint8_t* begin;
  const uint8_t* end;
};

struct Field {
  uint32_t number = 0;
  uint64_t value = 0;  // of a number, also of 32 bits
  Bytes bytes{nullptr, nullptr};
};

class Reader {
 public:
  Reader(Bytes bytes, const std::string& name) : at_(bytes.begin), end_(bytes.end), name_(name) {}

  bool next(Field& field) {
    if (at_ == end_) return false;
    const uint64_t key = varint();
    field = {uint32_t(key >> 3), 0, {nullptr, nullptr}};
    switch (key & 7) {
      case 0: field.value = varint(); break;
      case 1: fixed(8, field); break;
      case 2: field.bytes = take(varint()); break;
      case 5: fixed(4, field); break;
      default: fail();
    }
    return true;
  }

  uint64_t varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      if (at_ == end_) fail();
      const uint8_t byte = *at_++;
      value |= uint64_t(byte & 0x7f) << shift;
      if (byte < 0x80) return value;
    }
    fail();
  }

  bool is_at_end() const { return at_ == end_; }

  [[noreturn]] void fail() const {
    throw Error(MAQ_ERROR_BAD_BUNDLE, name_, " is not a valid ONNX file. Fetch or export the bundle again.");
  }

 private:
  Bytes take(uint64_t size) {
    if (size > uint64_t(end_ - at_)) fail();
    const Bytes taken{at_, at_ + size};
    at_ = taken.end;
    return taken;
  }
  void fixed(size_t size, Field& field) {
    field.bytes = take(size);
    std::memcpy(&field.value, field.bytes.begin, size);
  }

  const uint8_t* at_;
  const uint8_t* end_;
  const std::string& name_;
};

class OnnxParser {
 public:
  explicit OnnxParser(const std::string& name) : name_(name) {}

  OnnxModel model(Bytes bytes) {
    OnnxModel model;
    bool has_graph = false;
    each(bytes, [&](const Field& field) {
      if (field.number != 7) return;
      has_graph = true;
      each(field.bytes, [&](const Field& part) {
        if (part.number == 1) model.nodes.push_back(node(part.bytes));
        if (part.number == 5) {
          std::string tensor_name;
          OnnxTensor read = tensor(part.bytes, &tensor_name);
          model.constants[tensor_name] = std::move(read);
        }
        if (part.number == 11) model.inputs.push_back(value_info(part.bytes));
        if (part.number == 12) model.outputs.push_back(value_info(part.bytes));
      });
    });
    if (!has_graph) Reader(bytes, name_).fail();
    return model;
  }

 private:
  void each(Bytes bytes, const std::function<void(const Field&)>& use) const {
    Reader reader(bytes, name_);
    for (Field field; reader.next(field);) use(field);
  }

  static std::string text(Bytes bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.begin), size_t(bytes.end - bytes.begin));
  }

  // Repeated whole numbers, packed or one by one.
  void add_integers(const Field& field, std::vector<int64_t>& to) const {
    if (field.bytes.begin == nullptr) {
      to.push_back(int64_t(field.value));
      return;
    }
    for (Reader reader(field.bytes, name_); !reader.is_at_end();) to.push_back(int64_t(reader.varint()));
  }

  OnnxTensor tensor(Bytes bytes, std::string* tensor_name) const {
    OnnxTensor read;
    std::vector<int64_t> integers;
    int64_t type = 0;
    each(bytes, [&](const Field& field) {
      if (field.number == 1) add_integers(field, read.dims);
      if (field.number == 2) type = int64_t(field.value);
      if (field.number == 5 || field.number == 7) add_integers(field, integers);
      if (field.number == 8 && tensor_name != nullptr) *tensor_name = text(field.bytes);
      // raw_data, and float_data, which has the same bytes where it is packed
      if (field.number == 4 || field.number == 9) {
        read.bytes.insert(read.bytes.end(), field.bytes.begin, field.bytes.end);
      }
    });
    read.type = OnnxType(type);
    const size_t size = bytes_of(read.type);
    size_t count = 1;
    for (const int64_t extent : read.dims) {
      if (extent < 0 || __builtin_mul_overflow(count, size_t(extent), &count)) Reader(bytes, name_).fail();
    }
    for (const int64_t integer : integers) {
      const auto* from = reinterpret_cast<const uint8_t*>(&integer);
      read.bytes.insert(read.bytes.end(), from, from + size);
    }
    if (size == 0 || read.bytes.size() / size != count || read.bytes.size() % size != 0) Reader(bytes, name_).fail();
    return read;
  }

  OnnxNode node(Bytes bytes) const {
    OnnxNode read;
    each(bytes, [&](const Field& field) {
      if (field.number == 1) read.inputs.push_back(text(field.bytes));
      if (field.number == 2) read.outputs.push_back(text(field.bytes));
      if (field.number == 4) read.type = text(field.bytes);
      if (field.number != 5) return;
      std::string attribute_name;
      OnnxAttribute attribute;
      each(field.bytes, [&](const Field& part) {
        if (part.number == 1) attribute_name = text(part.bytes);
        if (part.number == 3) attribute.integer = int64_t(part.value);
        if (part.number == 5) attribute.tensor = tensor(part.bytes, nullptr);
        if (part.number == 8) add_integers(part, attribute.integers);
      });
      read.attributes[attribute_name] = std::move(attribute);
    });
    if (read.outputs.empty()) Reader(bytes, name_).fail();
    return read;
  }

  OnnxValueInfo value_info(Bytes bytes) const {
    OnnxValueInfo read;
    each(bytes, [&](const Field& field) {
      if (field.number == 1) read.name = text(field.bytes);
      if (field.number != 2) return;
      each(field.bytes, [&](const Field& type) {
        if (type.number != 1) return;
        each(type.bytes, [&](const Field& tensor_type) {
          if (tensor_type.number == 1) read.type = OnnxType(tensor_type.value);
          if (tensor_type.number != 2) return;
          each(tensor_type.bytes, [&](const Field& dimension) {
            if (dimension.number != 1) return;
            read.shape.push_back(-1);
            each(dimension.bytes, [&](const Field& size) {
              if (size.number == 1) read.shape.back() = int64_t(size.value);
            });
          });
        });
      });
    });
    return read;
  }

  const std::string& name_;
};

}  // namespace

size_t OnnxTensor::size() const { return bytes.size() / bytes_of(type); }

double OnnxTensor::number(size_t index) const {
  const uint8_t* const at = bytes.data() + index * bytes_of(type);
  const auto as = [at](auto value) {
    std::memcpy(&value, at, sizeof value);
    return double(value);
  };
  switch (type) {
    case OnnxType::kFloat: return as(float());
    case OnnxType::kUint8: return as(uint8_t());
    case OnnxType::kInt8: return as(int8_t());
    case OnnxType::kInt32: return as(int32_t());
    case OnnxType::kInt64: return as(int64_t());
  }
  return 0;
}

int64_t OnnxNode::integer(const std::string& name, int64_t fallback) const {
  const auto found = attributes.find(name);
  return found == attributes.end() ? fallback : found->second.integer;
}

std::vector<int64_t> OnnxNode::integers(const std::string& name, std::vector<int64_t> fallback) const {
  const auto found = attributes.find(name);
  return found == attributes.end() ? fallback : found->second.integers;
}

OnnxModel read_onnx(const std::vector<uint8_t>& bytes, const std::string& name) {
  return OnnxParser(name).model({bytes.data(), bytes.data() + bytes.size()});
}

}  // namespace maq
