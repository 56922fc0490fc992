#include "nn/provider.h"

#include <onnxruntime_c_api.h>

#include <cstring>
#include <memory>

#include "core/error.h"

namespace maq {
namespace {

constexpr int kAssignmentMinor = 24;      // the first 1.x release that tells which provider has which nodes
constexpr uint32_t kNnapiWithoutCpu = 4;  // NNAPI_FLAG_CPU_DISABLED: its reference kernels are slower than ours

const char* name_of(maq_provider provider) { return provider == MAQ_PROVIDER_XNNPACK ? "XNNPACK" : "NNAPI"; }

}  // namespace

void append_provider(const OnnxRuntimeLibrary& runtime, maq_provider provider, int threads,
                     OrtSessionOptions* options) {
  const std::string what = std::string(name_of(provider)) + " is not offered";
  if (provider == MAQ_PROVIDER_XNNPACK) {
    const std::string count = std::to_string(threads);
    const char* const key = "intra_op_num_threads";
    const char* const value = count.c_str();
    runtime.check(runtime.api().SessionOptionsAppendExecutionProvider(options, "XNNPACK", &key, &value, 1),
                  MAQ_ERROR_UNSUPPORTED, what);
    return;
  }
  using Append = OrtStatus*(ORT_API_CALL*)(OrtSessionOptions*, uint32_t flags);
  const auto append = reinterpret_cast<Append>(runtime.symbol("OrtSessionOptionsAppendExecutionProvider_Nnapi"));
  if (append == nullptr) throw Error(MAQ_ERROR_UNSUPPORTED, what + ": this build of ONNX Runtime is not for Android");
  runtime.check(append(options, kNnapiWithoutCpu), MAQ_ERROR_UNSUPPORTED, what);
}

maq_provider available_provider(const OnnxRuntimeLibrary& runtime, maq_provider wanted) {
  if (wanted == MAQ_PROVIDER_CPU) return wanted;
  const OrtApi& api = runtime.api();
  OrtSessionOptions* made = nullptr;
  runtime.check(api.CreateSessionOptions(&made), MAQ_ERROR_INTERNAL, "Networks cannot be prepared");
  const std::unique_ptr<OrtSessionOptions, decltype(api.ReleaseSessionOptions)> options(made,
                                                                                        api.ReleaseSessionOptions);
  try {
    append_provider(runtime, wanted, 1, options.get());
  } catch (const Error& error) {
    if (error.status() != MAQ_ERROR_UNSUPPORTED) throw;
    runtime.log().write(MAQ_LOG_WARNING, "Networks run on the CPU: ", error.what());
    return MAQ_PROVIDER_CPU;
  }
  return wanted;
}

void check_assignment(const OnnxRuntimeLibrary& runtime, maq_provider provider, const OrtSession* session,
                      const std::string& name) {
  if (runtime.minor_version() < kAssignmentMinor) return;
  const OrtApi& api = runtime.api();
  const auto check = [&](OrtStatus* result) { runtime.check(result, MAQ_ERROR_UNSUPPORTED, name); };
  const OrtEpAssignedSubgraph* const* subgraphs = nullptr;
  size_t count = 0, parts = 0, nodes = 0, taken = 0;
  check(api.Session_GetEpGraphAssignmentInfo(session, &subgraphs, &count));
  for (size_t i = 0; i < count; ++i) {
    const char* owner = nullptr;
    const OrtEpAssignedNode* const* members = nullptr;
    size_t size = 0;
    check(api.EpAssignedSubgraph_GetEpName(subgraphs[i], &owner));
    check(api.EpAssignedSubgraph_GetNodes(subgraphs[i], &members, &size));
    const bool is_of_cpu = std::strcmp(owner, "CPUExecutionProvider") == 0;
    nodes += size;
    taken += is_of_cpu ? 0 : size;
    parts += is_of_cpu ? 0 : 1;
  }
  const std::string taken_nodes =
      concatenate(name_of(provider), " takes ", taken, " of ", nodes, " nodes, in ", parts, " parts");
  if (2 * taken < nodes) throw Error(MAQ_ERROR_UNSUPPORTED, taken_nodes);
  runtime.log().write(MAQ_LOG_INFO, name, ": ", taken_nodes);
}

}  // namespace maq
