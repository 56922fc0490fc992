#include "support/fakes/fake_provider_onnxruntime.h"

#include <dlfcn.h>
#include <onnxruntime_c_api.h>
#include <string.h>

static FakeProviders state;
static const OrtApi* real;
static OrtApi fake;

__attribute__((visibility("default"))) FakeProviders* fake_providers(void) { return &state; }

static void note(const char* name, const char* threads) {
  ++state.appended;
  strncpy(state.name, name, sizeof state.name - 1);
  strncpy(state.threads, threads, sizeof state.threads - 1);
}

static OrtStatusPtr ORT_API_CALL append(OrtSessionOptions* options, const char* name, const char* const* keys,
                                        const char* const* values, size_t count) {
  (void)options;
  note(name, count == 1 && strcmp(keys[0], "intra_op_num_threads") == 0 ? values[0] : "");
  return NULL;
}

__attribute__((visibility("default"))) OrtStatusPtr ORT_API_CALL
OrtSessionOptionsAppendExecutionProvider_Nnapi(OrtSessionOptions* options, uint32_t flags) {
  (void)options;
  note("NNAPI", flags == 4 ? "no CPU" : "");
  return NULL;
}

static OrtStatusPtr ORT_API_CALL set_threads(OrtSessionOptions* options, int count) {
  state.session_threads = count;
  return real->SetIntraOpNumThreads(options, count);
}

static int records;  // whether the session that is made next has a provider

static OrtStatusPtr ORT_API_CALL add_entry(OrtSessionOptions* options, const char* key, const char* value) {
  if (strcmp(key, "session.intra_op.allow_spinning") == 0) strncpy(state.spins, value, sizeof state.spins - 1);
  records |= strcmp(key, "session.record_ep_graph_assignment_info") == 0 && strcmp(value, "1") == 0;
  return real->AddSessionConfigEntry(options, key, value);
}

static OrtStatusPtr ORT_API_CALL make_session(const OrtEnv* env, const void* bytes, size_t size,
                                              const OrtSessionOptions* options, OrtSession** session) {
  const int has_provider = records;
  records = 0;
  if (has_provider && state.fails) return real->CreateStatus(ORT_FAIL, "the device is busy");
  return real->CreateSessionFromArray(env, bytes, size, options, session);
}

// Two parts of one owner each: the provider's nodes, then the CPU's.
static const int parts[2] = {0, 1};

static OrtStatusPtr ORT_API_CALL get_parts(const OrtSession* session, const OrtEpAssignedSubgraph* const** out,
                                           size_t* count) {
  static const OrtEpAssignedSubgraph* all[2];
  (void)session;
  for (int i = 0; i < 2; ++i) all[i] = (const OrtEpAssignedSubgraph*)&parts[i];
  *out = all;
  *count = 2;
  return NULL;
}

static OrtStatusPtr ORT_API_CALL get_owner(const OrtEpAssignedSubgraph* part, const char** out) {
  *out = *(const int*)part == 0 ? "XnnpackExecutionProvider" : "CPUExecutionProvider";
  return NULL;
}

static OrtStatusPtr ORT_API_CALL get_nodes(const OrtEpAssignedSubgraph* part, const OrtEpAssignedNode* const** out,
                                           size_t* count) {
  *out = NULL;
  *count = (size_t)(*(const int*)part == 0 ? state.taken_nodes : state.other_nodes);
  return NULL;
}

static const OrtApi* ORT_API_CALL get_api(uint32_t version) { return version <= ORT_API_VERSION ? &fake : NULL; }

static const char* ORT_API_CALL get_version(void) { return "1.26.0"; }

__attribute__((visibility("default"))) const OrtApiBase* ORT_API_CALL OrtGetApiBase(void) {
  static const OrtApiBase base = {get_api, get_version};
  void* library = dlopen(MAQ_TEST_ONNXRUNTIME, RTLD_NOW | RTLD_LOCAL);
  const OrtApiBase* (*get_base)(void) = NULL;
  if (library == NULL) return NULL;
  *(void**)&get_base = dlsym(library, "OrtGetApiBase");
  real = get_base()->GetApi(ORT_API_VERSION);
  if (real == NULL) return NULL;
  fake = *real;
  fake.SessionOptionsAppendExecutionProvider = append;
  fake.SetIntraOpNumThreads = set_threads;
  fake.AddSessionConfigEntry = add_entry;
  fake.CreateSessionFromArray = make_session;
  fake.Session_GetEpGraphAssignmentInfo = get_parts;
  fake.EpAssignedSubgraph_GetEpName = get_owner;
  fake.EpAssignedSubgraph_GetNodes = get_nodes;
  return &base;
}
