#include "nn/session.h"

#include <onnxruntime_c_api.h>

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/memory.h"
#include "nn/provider.h"
#include "nn/session_threads.h"

namespace maq {
namespace {

// How long an idle thread spins for the next layer before it sleeps, in microseconds. Layers follow each other within
// this time. Measured with dense pose, 2 threads on 2 cores: ONNX Runtime's default of 1,000 has 116 frames a second on
// an idle machine and 46 beside a busy process, no spinning 92 and 78, this 112 and 76.
constexpr char kSpin_us[] = "20";

void ORT_API_CALL forward_to_log(void* log, OrtLoggingLevel severity, const char*, const char*, const char*,
                                 const char* message) {
  const maq_log_level level = severity >= ORT_LOGGING_LEVEL_ERROR ? MAQ_LOG_ERROR : MAQ_LOG_WARNING;
  if (says_out_of_memory(message)) return;  // the call that fails says so
  try {
    static_cast<const Log*>(log)->write(level, "ONNX Runtime: ", without_source_place(message));
  } catch (const std::bad_alloc&) {  // may not pass through ONNX Runtime
  }
}

std::string to_text(const std::vector<int64_t>& shape) {
  std::string text = "[";
  for (const int64_t size : shape) text += (text.size() > 1 ? ", " : "") + (size < 0 ? "?" : std::to_string(size));
  return text + "]";
}

std::string to_text(const std::vector<Dimension>& shape) {
  std::string text = "[";
  for (const Dimension& size : shape) {
    text += text.size() > 1 ? ", " : "";
    text +=
        std::holds_alternative<int64_t>(size) ? std::to_string(std::get<int64_t>(size)) : std::get<std::string>(size);
  }
  return text + "]";
}

// A named or unknown size fits every number.
bool fits(const std::vector<int64_t>& actual, const std::vector<Dimension>& expected) {
  if (actual.size() != expected.size()) return false;
  for (size_t i = 0; i < actual.size(); ++i) {
    const int64_t* fixed = std::get_if<int64_t>(&expected[i]);
    if (fixed != nullptr && actual[i] >= 0 && actual[i] != *fixed) return false;
  }
  return true;
}

}  // namespace

RunCancel::RunCancel(std::shared_ptr<const OnnxRuntimeLibrary> runtime) : runtime_(std::move(runtime)) {
  runtime_->check(runtime_->api().CreateRunOptions(&options_), MAQ_ERROR_INTERNAL, "Runs cannot be cancelled");
}

RunCancel::~RunCancel() { runtime_->api().ReleaseRunOptions(options_); }

void RunCancel::cancel() noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_cancelled_ = true;
  runtime_->api().ReleaseStatus(runtime_->api().RunOptionsSetTerminate(options_));
}

void RunCancel::reset() noexcept {
  if (!is_cancelled_) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  runtime_->api().ReleaseStatus(runtime_->api().RunOptionsUnsetTerminate(options_));
  is_cancelled_ = false;
}

void RunCancel::check() const {
  if (is_cancelled_) throw Error(MAQ_CANCELLED, "The app cancelled the run.");
}

// A network that ONNX Runtime runs.
class OnnxRuntimeSession final : public Session {
 public:
  OnnxRuntimeSession(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const std::vector<uint8_t>& bytes,
                     GraphSpec spec, std::string name, const SessionSettings& settings);
  ~OnnxRuntimeSession() override;

  const std::vector<TensorView>& run(const std::vector<TensorView>& inputs, const std::vector<Shape>& output_shapes,
                                     const RunCancel* cancel, float* first_output) override;
  maq_provider provider() const override { return provider_; }

 private:
  struct GraphSide;

  void open(const std::vector<uint8_t>& bytes, const SessionSettings& settings);

  void compare_with_spec() const;
  // Throws unless the graph has each of `expected` with its type and shape; returns how many it has in all.
  size_t compare_side(const GraphSide& side, const std::vector<TensorSpec>& expected) const;

  // A tensor as ONNX Runtime wants it, made anew only when its address or shape changes.
  struct Binding {
    OrtValue* value = nullptr;
    const float* data = nullptr;
    Shape shape;
  };
  void bind(Binding& binding, const float* data, const Shape& shape);
  // Throws MAQ_ERROR_INFERENCE for an error.
  void check_run(OrtStatus* status) const;
  void release();

  std::shared_ptr<const OnnxRuntimeLibrary> runtime_;
  GraphSpec spec_;
  std::string name_;
  maq_provider provider_ = MAQ_PROVIDER_CPU;
  std::optional<SessionThreads> threads_;
  OrtSession* session_ = nullptr;
  OrtMemoryInfo* cpu_memory_ = nullptr;
  std::vector<const char*> input_names_, output_names_;
  std::vector<Binding> inputs_, outputs_;
  std::vector<const OrtValue*> input_values_;
  std::vector<OrtValue*> output_values_;
  std::vector<std::vector<float>> buffers_;  // memory of the outputs
  std::vector<TensorView> views_;
};

// ONNX Runtime asks the same of inputs and of outputs, by functions of different names.
struct OnnxRuntimeSession::GraphSide {
  const char* kind;
  decltype(OrtApi::SessionGetInputCount) count;
  decltype(OrtApi::SessionGetInputName) name;
  decltype(OrtApi::SessionGetInputTypeInfo) type;
};

OnnxRuntimeSession::OnnxRuntimeSession(std::shared_ptr<const OnnxRuntimeLibrary> runtime,
                                       const std::vector<uint8_t>& bytes, GraphSpec spec, std::string name,
                                       const SessionSettings& settings)
    : runtime_(std::move(runtime)), spec_(std::move(spec)), name_(std::move(name)), provider_(settings.provider) {
  const OrtApi& api = runtime_->api();
  try {
    try {
      open(bytes, settings);
    } catch (const Error& error) {
      if (provider_ == MAQ_PROVIDER_CPU || error.status() == MAQ_ERROR_OUT_OF_MEMORY) throw;
      runtime_->log().write(MAQ_LOG_WARNING, name_, " runs on the CPU: ", error.what());
      api.ReleaseSession(std::exchange(session_, nullptr));
      provider_ = MAQ_PROVIDER_CPU;
      open(bytes, settings);
    }
    runtime_->check(api.CreateCpuMemoryInfo(OrtDeviceAllocator, OrtMemTypeDefault, &cpu_memory_), MAQ_ERROR_BAD_BUNDLE,
                    name_);
    compare_with_spec();
    for (const TensorSpec& input : spec_.inputs) input_names_.push_back(input.name.c_str());
    for (const TensorSpec& output : spec_.outputs) output_names_.push_back(output.name.c_str());
    inputs_.resize(input_names_.size());
    outputs_.resize(output_names_.size());
    input_values_.resize(input_names_.size());
    output_values_.resize(output_names_.size());
    buffers_.resize(output_names_.size());
    views_.resize(output_names_.size());
  } catch (...) {
    release();
    throw;
  }
}

OnnxRuntimeSession::~OnnxRuntimeSession() { release(); }

void OnnxRuntimeSession::open(const std::vector<uint8_t>& bytes, const SessionSettings& settings) {
  const OrtApi& api = runtime_->api();
  const auto check = [&](OrtStatus* result) {
    runtime_->check(result, MAQ_ERROR_BAD_BUNDLE, concatenate(name_, " cannot be loaded"));
  };
  require_memory(kThreadLocalBytes);  // that of this thread
  OrtSessionOptions* made = nullptr;
  check(api.CreateSessionOptions(&made));
  const std::unique_ptr<OrtSessionOptions, decltype(api.ReleaseSessionOptions)> options(made,
                                                                                        api.ReleaseSessionOptions);
  check(api.SetUserLoggingFunction(options.get(), forward_to_log, const_cast<Log*>(&runtime_->log())));
  // XNNPACK has its own threads. ONNX Runtime then recommends one thread for the session, which does not spin:
  // https://onnxruntime.ai/docs/execution-providers/Xnnpack-ExecutionProvider.html
  const bool has_own_threads = provider_ == MAQ_PROVIDER_XNNPACK;
  threads_.emplace(has_own_threads ? 0 : settings.threads - 1);  // the first is the caller of run()
  const int thread_count = threads_->count() + 1;
  if (!threads_->shortage().empty()) {
    runtime_->log().write(MAQ_LOG_WARNING, name_, " runs on ", thread_count, " of ", settings.threads,
                          " threads, which takes longer. ", threads_->shortage());
  }
  check(api.SetIntraOpNumThreads(options.get(), thread_count));
  check(api.SessionOptionsSetCustomCreateThreadFn(options.get(), SessionThreads::assign));
  check(api.SessionOptionsSetCustomThreadCreationOptions(options.get(), &*threads_));
  check(api.SessionOptionsSetCustomJoinThreadFn(options.get(), SessionThreads::join));
  check(api.SetSessionGraphOptimizationLevel(options.get(), ORT_ENABLE_ALL));
  // The networks run one after another: the threads of one must not keep spinning while the next one works.
  check(api.AddSessionConfigEntry(options.get(), "session.force_spinning_stop", "1"));
  check(api.AddSessionConfigEntry(options.get(), "session.intra_op.allow_spinning", has_own_threads ? "0" : "1"));
  check(api.AddSessionConfigEntry(options.get(), "session.intra_op.spin_duration_us", kSpin_us));
  if (!settings.plans_memory) check(api.DisableMemPattern(options.get()));
  for (const auto& [size_name, size] : settings.fixed_sizes) {
    check(api.AddFreeDimensionOverrideByName(options.get(), size_name.c_str(), size));
  }
  if (provider_ != MAQ_PROVIDER_CPU) {
    append_provider(*runtime_, provider_, settings.threads, options.get());
    check(api.AddSessionConfigEntry(options.get(), "session.record_ep_graph_assignment_info", "1"));
  }
  check(api.CreateSessionFromArray(runtime_->env(), bytes.data(), bytes.size(), options.get(), &session_));
  if (provider_ != MAQ_PROVIDER_CPU) check_assignment(*runtime_, provider_, session_, name_);
}

void OnnxRuntimeSession::release() {
  const OrtApi& api = runtime_->api();
  for (std::vector<Binding>* side : {&inputs_, &outputs_}) {
    for (const Binding& binding : *side) api.ReleaseValue(binding.value);
  }
  api.ReleaseMemoryInfo(cpu_memory_);
  api.ReleaseSession(session_);
}

void OnnxRuntimeSession::compare_with_spec() const {
  const OrtApi& api = runtime_->api();
  const GraphSide inputs{"input", api.SessionGetInputCount, api.SessionGetInputName, api.SessionGetInputTypeInfo};
  const GraphSide outputs{"output", api.SessionGetOutputCount, api.SessionGetOutputName, api.SessionGetOutputTypeInfo};
  const size_t input_count = compare_side(inputs, spec_.inputs);
  compare_side(outputs, spec_.outputs);
  if (input_count != spec_.inputs.size()) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, name_, " has ", input_count, " inputs, but the manifest lists ",
                spec_.inputs.size(), ". Export the bundle again.");
  }
}

size_t OnnxRuntimeSession::compare_side(const GraphSide& side, const std::vector<TensorSpec>& expected) const {
  const auto check = [&](OrtStatus* result) {
    runtime_->check(result, MAQ_ERROR_BAD_BUNDLE, concatenate(name_, " cannot be inspected"));
  };
  const OrtApi& api = runtime_->api();
  OrtAllocator* allocator = nullptr;
  check(api.GetAllocatorWithDefaultOptions(&allocator));
  size_t count = 0;
  check(side.count(session_, &count));
  std::map<std::string, size_t> index_of;
  for (size_t i = 0; i < count; ++i) {
    char* name = nullptr;
    check(side.name(session_, i, allocator, &name));
    index_of[name] = i;
    check(api.AllocatorFree(allocator, name));
  }
  for (const TensorSpec& tensor : expected) {
    const auto found = index_of.find(tensor.name);
    if (found == index_of.end()) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, name_, " has no ", side.kind, " ", tensor.name,
                  ", but the manifest lists it. Export the bundle again.");
    }
    OrtTypeInfo* made = nullptr;
    check(side.type(session_, found->second, &made));
    const std::unique_ptr<OrtTypeInfo, decltype(api.ReleaseTypeInfo)> type(made, api.ReleaseTypeInfo);
    const OrtTensorTypeAndShapeInfo* info = nullptr;
    check(api.CastTypeInfoToTensorInfo(type.get(), &info));
    ONNXTensorElementDataType element = ONNX_TENSOR_ELEMENT_DATA_TYPE_UNDEFINED;
    if (info != nullptr) check(api.GetTensorElementType(info, &element));
    if (tensor.type != "float32" || element != ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, name_, ": ", side.kind, " ", tensor.name,
                  " must be float32 in the manifest and in the graph. Export the bundle again.");
    }
    size_t rank = 0;
    check(api.GetDimensionsCount(info, &rank));
    std::vector<int64_t> shape(rank);
    check(api.GetDimensions(info, shape.data(), rank));
    if (!fits(shape, tensor.shape)) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, name_, ": ", side.kind, " ", tensor.name, " has shape ", to_text(shape),
                  " in the graph, but ", to_text(tensor.shape), " in the manifest. Export the bundle again.");
    }
  }
  return count;
}

void OnnxRuntimeSession::check_run(OrtStatus* status) const {
  if (status != nullptr) runtime_->check(status, MAQ_ERROR_INFERENCE, concatenate(name_, " failed to run"));
}

void OnnxRuntimeSession::bind(Binding& binding, const float* data, const Shape& shape) {
  if (binding.value != nullptr && binding.data == data && binding.shape == shape) return;
  const OrtApi& api = runtime_->api();
  api.ReleaseValue(binding.value);
  binding.value = nullptr;
  int64_t size = 1;
  for (const int64_t extent : shape) size *= extent;
  // ONNX Runtime takes a mutable pointer but does not write to an input.
  check_run(api.CreateTensorWithDataAsOrtValue(cpu_memory_, const_cast<float*>(data), size_t(size) * sizeof(float),
                                               shape.data(), shape.size(), ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT,
                                               &binding.value));
  binding.data = data;
  binding.shape = shape;
}

const std::vector<TensorView>& OnnxRuntimeSession::run(const std::vector<TensorView>& inputs,
                                                       const std::vector<Shape>& output_shapes, const RunCancel* cancel,
                                                       float* first_output) {
  for (size_t i = 0; i < inputs_.size(); ++i) {
    bind(inputs_[i], inputs[i].data, inputs[i].shape);
    input_values_[i] = inputs_[i].value;
  }
  for (size_t i = 0; i < outputs_.size(); ++i) {
    int64_t size = 1;
    for (const int64_t extent : output_shapes[i]) size *= extent;
    const bool is_given = i == 0 && first_output != nullptr;
    if (!is_given && buffers_[i].size() < size_t(size)) buffers_[i].resize(size_t(size));
    float* const memory = is_given ? first_output : buffers_[i].data();
    bind(outputs_[i], memory, output_shapes[i]);
    output_values_[i] = outputs_[i].value;
    views_[i].data = memory;
    views_[i].shape = output_shapes[i];
  }
  OrtStatus* status = runtime_->api().Run(session_, cancel == nullptr ? nullptr : cancel->options_, input_names_.data(),
                                          input_values_.data(), input_values_.size(), output_names_.data(),
                                          output_names_.size(), output_values_.data());
  if (status != nullptr && cancel != nullptr && cancel->is_cancelled_) {
    runtime_->api().ReleaseStatus(status);
    cancel->check();
  }
  check_run(status);
  return views_;
}

std::unique_ptr<Session> open_session(std::shared_ptr<const OnnxRuntimeLibrary> runtime,
                                      const std::vector<uint8_t>& bytes, GraphSpec spec, std::string name,
                                      const SessionSettings& settings) {
  return std::make_unique<OnnxRuntimeSession>(std::move(runtime), bytes, std::move(spec), std::move(name), settings);
}

}  // namespace maq
