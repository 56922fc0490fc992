// One network of a bundle, ready to run.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nn/manifest.h"
#include "nn/onnxruntime_library.h"

namespace maq {

// A float tensor [shape], row-major, that somebody else owns.
struct TensorView {
  const float* data = nullptr;
  std::vector<int64_t> shape;
};

// The outputs of one run, in the order of the graph's spec; they own their memory.
class NetworkOutputs {
 public:
  NetworkOutputs(std::shared_ptr<const OnnxRuntimeLibrary> runtime, std::vector<OrtValue*> values);
  ~NetworkOutputs();
  NetworkOutputs(NetworkOutputs&&) = default;
  NetworkOutputs(const NetworkOutputs&) = delete;
  NetworkOutputs& operator=(const NetworkOutputs&) = delete;

  const TensorView& operator[](size_t index) const { return views_[index]; }

 private:
  std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  std::vector<OrtValue*> values_;
  std::vector<TensorView> views_;
};

class Session {
 public:
  // Prepares `bytes` (an ONNX model without external data) to run on `threads` threads, and compares its inputs and
  // outputs with `spec`. `name` names it in errors. Throws MAQ_ERROR_BAD_BUNDLE.
  Session(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const std::vector<uint8_t>& bytes, GraphSpec spec,
          std::string name, int threads);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Runs the network on its one input. Throws MAQ_ERROR_INFERENCE, also when an output has not the spec's shape:
  // `shape_of_outputs` are those expected, one for each output.
  NetworkOutputs run(const float* input, const std::vector<int64_t>& input_shape,
                     const std::vector<std::vector<int64_t>>& shape_of_outputs) const;

 private:
  struct GraphSide;

  void compare_with_spec() const;
  // Throws unless the graph has each of `expected` with its type and shape; returns how many it has in all.
  size_t compare_side(const GraphSide& side, const std::vector<TensorSpec>& expected) const;

  std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  GraphSpec spec_;
  std::string name_;
  OrtSession* session_ = nullptr;
  OrtMemoryInfo* cpu_memory_ = nullptr;
};

}  // namespace maq
