/* A libonnxruntime.so of long ago: it has no interface as new as those that are asked for. */
#include <onnxruntime_c_api.h>
#include <stddef.h>

static const OrtApi* ORT_API_CALL get_api(uint32_t version) {
  (void)version;
  return NULL;
}
static const char* ORT_API_CALL get_version(void) { return "1.9.0"; }

__attribute__((visibility("default"))) const OrtApiBase* ORT_API_CALL OrtGetApiBase(void) {
  static const OrtApiBase base = {get_api, get_version};
  return &base;
}
