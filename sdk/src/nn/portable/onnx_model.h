// An ONNX file, as far as dense pose needs it: nodes, weights, and the names and shapes of inputs and outputs.
// https://github.com/onnx/onnx/blob/main/onnx/onnx.proto gives the field numbers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace maq {

enum class OnnxType { kFloat = 1, kUint8 = 2, kInt8 = 3, kInt32 = 6, kInt64 = 7 };

struct OnnxTensor {
  OnnxType type = OnnxType::kFloat;
  std::vector<int64_t> dims;
  std::vector<uint8_t> bytes;  // little-endian, as many as type and dims say

  size_t size() const;
  double number(size_t index) const;
};

struct OnnxAttribute {
  int64_t integer = 0;
  std::vector<int64_t> integers;
  OnnxTensor tensor;
};

struct OnnxNode {
  std::string type;
  std::vector<std::string> inputs, outputs;
  std::map<std::string, OnnxAttribute> attributes;

  int64_t integer(const std::string& name, int64_t fallback) const;
  std::vector<int64_t> integers(const std::string& name, std::vector<int64_t> fallback) const;
};

// A size that the graph leaves open is -1.
struct OnnxValueInfo {
  std::string name;
  OnnxType type = OnnxType::kFloat;
  std::vector<int64_t> shape;
};

struct OnnxModel {
  std::vector<OnnxNode> nodes;  // each after the nodes that it reads from
  std::map<std::string, OnnxTensor> constants;
  std::vector<OnnxValueInfo> inputs, outputs;
};

// Throws MAQ_ERROR_BAD_BUNDLE for bytes that are not such a file. `name` names it in errors.
OnnxModel read_onnx(const std::vector<uint8_t>& bytes, const std::string& name);

}  // namespace maq
