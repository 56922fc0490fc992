// The parts of this folder that ask ONNX Runtime, in builds without it.
#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/worker_threads.h"
#include "nn/portable/network.h"
#include "nn/portable/network_builder.h"
#include "nn/portable/onnx_model.h"
#include "nn/provider.h"
#include "nn/session.h"

namespace maq {
namespace {

// Sizes of 1 take the place of axes that a shape does not have, before the channels: [boxes, values] is
// [boxes, 1, 1, values].
Extents extents_of(const Shape& shape) {
  Extents extents{1, 1, 1, 1};
  for (size_t i = 0; i + 1 < shape.size(); ++i) extents[i] = int(shape[i]);
  if (shape.size() > 0) extents[3] = int(shape[shape.size() - 1]);
  return extents;
}

bool fits(const std::vector<int64_t>& actual, const std::vector<Dimension>& expected) {
  return std::equal(actual.begin(), actual.end(), expected.begin(), expected.end(), [](int64_t size, const auto& spec) {
    const int64_t* fixed = std::get_if<int64_t>(&spec);
    return fixed == nullptr || size < 0 || size == *fixed;
  });
}

// Returns the place of each tensor of the manifest in the list of the graph.
std::vector<size_t> places(const char* kind, const std::vector<OnnxValueInfo>& graph,
                           const std::vector<TensorSpec>& specs, const std::string& name) {
  std::vector<size_t> found;
  for (const TensorSpec& spec : specs) {
    const auto at =
        std::find_if(graph.begin(), graph.end(), [&](const OnnxValueInfo& info) { return info.name == spec.name; });
    if (at == graph.end() || at->type != OnnxType::kFloat || spec.type != "float32" || !fits(at->shape, spec.shape)) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, name, ": ", kind, " ", spec.name,
                  " is not in the graph as the manifest lists it. Export the bundle again.");
    }
    found.push_back(size_t(at - graph.begin()));
  }
  return found;
}

// The threads of all sessions, which run one after another: a browser has to start each before it is needed. Layers
// take some 0.1 ms, so that a thread stays awake until the next one.
std::shared_ptr<WorkerThreads> shared_threads(int count) {
  static std::weak_ptr<WorkerThreads> shared;
  std::shared_ptr<WorkerThreads> threads = shared.lock();
  if (threads == nullptr) {
    threads = std::make_shared<WorkerThreads>(count, std::chrono::microseconds(200));
    shared = threads;
  }
  return threads;
}

// A network that runs on the kernels of nn/portable.
class PortableSession final : public Session {
 public:
  PortableSession(const std::vector<uint8_t>& bytes, const GraphSpec& spec, const std::string& name, int threads)
      : name_(name), threads_(shared_threads(threads)) {
    const OnnxModel model = read_onnx(bytes, name);
    inputs_at_ = places("input", model.inputs, spec.inputs, name);
    outputs_at_ = places("output", model.outputs, spec.outputs, name);
    if (model.inputs.size() != spec.inputs.size()) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, name, " has ", model.inputs.size(), " inputs, but the manifest lists ",
                  spec.inputs.size(), ". Export the bundle again.");
    }
    inputs_.resize(model.inputs.size());
    outputs_.resize(model.outputs.size());
    buffers_.resize(model.outputs.size());
    views_.resize(spec.outputs.size());
    network_.emplace(build_network(model, name));
  }

  const std::vector<TensorView>& run(const std::vector<TensorView>& inputs, const std::vector<Shape>& output_shapes,
                                     const RunCancel* cancel, float* first_output) override {
    if (cancel != nullptr) cancel->check();
    for (size_t i = 0; i < inputs_at_.size(); ++i) {
      Tensor& input = inputs_[inputs_at_[i]];
      input.extents = extents_of(inputs[i].shape);
      input.floats = const_cast<float*>(inputs[i].data);  // layers do not write to their inputs
    }
    for (size_t i = 0; i < outputs_at_.size(); ++i) {
      Tensor& output = outputs_[outputs_at_[i]];
      std::vector<float>& buffer = buffers_[outputs_at_[i]];
      output.extents = extents_of(output_shapes[i]);
      const bool is_given = i == 0 && first_output != nullptr;
      if (!is_given && buffer.size() < count_of(output.extents)) buffer.resize(count_of(output.extents));
      output.floats = is_given ? first_output : buffer.data();
      views_[i] = {output.floats, output_shapes[i]};
    }
    try {
      network_->run(inputs_, outputs_, *threads_);
    } catch (const Error& error) {
      throw Error(error.status(), name_, " failed to run: ", error.what());
    }
    return views_;
  }

  maq_provider provider() const override { return MAQ_PROVIDER_CPU; }

 private:
  std::string name_;
  std::shared_ptr<WorkerThreads> threads_;
  std::optional<PortableNetwork> network_;
  std::vector<size_t> inputs_at_, outputs_at_;
  std::vector<Tensor> inputs_, outputs_;
  std::vector<std::vector<float>> buffers_;
  std::vector<TensorView> views_;
};

}  // namespace

RunCancel::RunCancel(std::shared_ptr<const OnnxRuntimeLibrary> runtime) : runtime_(std::move(runtime)) {}

RunCancel::~RunCancel() = default;

void RunCancel::cancel() noexcept { is_cancelled_ = true; }

void RunCancel::reset() noexcept { is_cancelled_ = false; }

void RunCancel::check() const {
  if (is_cancelled_) throw Error(MAQ_CANCELLED, "The app cancelled the run.");
}

std::unique_ptr<Session> open_session(std::shared_ptr<const OnnxRuntimeLibrary>, const std::vector<uint8_t>& bytes,
                                      GraphSpec spec, std::string name, const SessionSettings& settings) {
  return std::make_unique<PortableSession>(bytes, spec, name, settings.threads);
}

// Sessions run on nn/portable.
OnnxRuntimeLibrary::OnnxRuntimeLibrary(const std::string&, const Log& log) : log_(log), version_("none") {}

OnnxRuntimeLibrary::~OnnxRuntimeLibrary() = default;

maq_provider available_provider(const OnnxRuntimeLibrary& runtime, maq_provider wanted) {
  if (wanted != MAQ_PROVIDER_CPU) {
    runtime.log().write(MAQ_LOG_WARNING, "Networks run on the CPU: there are no other providers in WebAssembly.");
  }
  return MAQ_PROVIDER_CPU;
}

}  // namespace maq
