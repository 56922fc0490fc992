// One network of a bundle, ready to run.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nn/manifest.h"
#include "nn/onnxruntime_library.h"

namespace maq {

// The sizes of a tensor, at most four, without heap memory.
class Shape {
 public:
  Shape() = default;
  Shape(std::initializer_list<int64_t> sizes) : rank_(std::min(sizes.size(), sizes_.size())) {
    std::copy_n(sizes.begin(), rank_, sizes_.begin());
  }

  size_t size() const { return rank_; }
  const int64_t* data() const { return sizes_.data(); }
  const int64_t* begin() const { return data(); }
  const int64_t* end() const { return data() + rank_; }
  int64_t& operator[](size_t axis) { return sizes_[axis]; }
  int64_t operator[](size_t axis) const { return sizes_[axis]; }
  bool operator==(const Shape& other) const { return rank_ == other.rank_ && sizes_ == other.sizes_; }

 private:
  std::array<int64_t, 4> sizes_{};
  size_t rank_ = 0;
};

// A float tensor, row-major, in memory of another owner.
struct TensorView {
  const float* data = nullptr;
  Shape shape;
};

struct SessionSettings {
  int threads = 1;
  // Sizes that the graph leaves open, by the names it has for them: fixed, it runs faster, for inputs of these sizes
  // only.
  std::vector<std::pair<std::string, int64_t>> fixed_sizes = {};
  // Whether memory is planned for each size of input after its first run. With inputs of many sizes, or large ones,
  // that takes more than it saves.
  bool plans_memory = true;
  // Runs the nodes that it supports; if it is missing or takes too few nodes, the session runs on the CPU.
  maq_provider provider = MAQ_PROVIDER_CPU;
};

// Ends a run from another thread: the one that runs, or else the next.
class RunCancel {
 public:
  explicit RunCancel(std::shared_ptr<const OnnxRuntimeLibrary> runtime);
  ~RunCancel();
  RunCancel(const RunCancel&) = delete;
  RunCancel& operator=(const RunCancel&) = delete;

  // Any thread.
  void cancel() noexcept;
  // Called by the running thread. Throws MAQ_CANCELLED after cancel(), until reset().
  void check() const;
  void reset() noexcept;

 private:
  friend class OnnxRuntimeSession;

  std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  OrtRunOptions* options_ = nullptr;
  std::mutex mutex_;  // guards changes, so that both of these agree
  std::atomic<bool> is_cancelled_{false};
};

// A network that is ready to run.
class Session {
 public:
  Session() = default;
  virtual ~Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Runs the network on its inputs, in the order of the spec. The outputs, of the shapes that the caller expects and in
  // the order of the spec, lie in memory of the session and stay until the next run. Not for two threads at once.
  // Throws MAQ_ERROR_INFERENCE, also when an output has another shape; MAQ_CANCELLED, between two nodes of the graph,
  // where `cancel` says so. `first_output`: memory for the first output instead of the session's. It may be an input's
  // memory if the graph reads that input before it writes.
  virtual const std::vector<TensorView>& run(const std::vector<TensorView>& inputs,
                                             const std::vector<Shape>& output_shapes, const RunCancel* cancel = nullptr,
                                             float* first_output = nullptr) = 0;

  // The one in use.
  virtual maq_provider provider() const = 0;
};

// Prepares `bytes` (an ONNX model without external data) to run, and compares its inputs and outputs with `spec`.
// `name` names it in errors. Throws MAQ_ERROR_BAD_BUNDLE. ONNX Runtime runs it; in WebAssembly, nn/portable does.
std::unique_ptr<Session> open_session(std::shared_ptr<const OnnxRuntimeLibrary> runtime,
                                      const std::vector<uint8_t>& bytes, GraphSpec spec, std::string name,
                                      const SessionSettings& settings);

}  // namespace maq
