#include "api/boundary.h"
#include "core/build_info.h"

using namespace maq;

namespace {

maq_context_config default_context_config() {
  maq_context_config config{};
  config.struct_size = sizeof config;
  return config;
}

// While the major version is 0, a minor version may change anything.
void check_header_version(uint32_t header_version) {
  if (header_version / 100 != MAQ_HEADER_VERSION / 100) {
    throw Error(MAQ_ERROR_VERSION_MISMATCH, "The app was built with headers of version ", header_version / 10000, ".",
                header_version / 100 % 100, ".", header_version % 100, ", but this library is ", sdk_version(),
                "; build the app again with the library's own headers and pass MAQ_HEADER_VERSION.");
  }
}

}  // namespace

const char* maq_status_get_name(maq_status status) {
  switch (status) {
    case MAQ_OK: return "MAQ_OK";
    case MAQ_ERROR_INVALID_ARGUMENT: return "MAQ_ERROR_INVALID_ARGUMENT";
    case MAQ_ERROR_VERSION_MISMATCH: return "MAQ_ERROR_VERSION_MISMATCH";
    case MAQ_ERROR_NOT_FOUND: return "MAQ_ERROR_NOT_FOUND";
    case MAQ_ERROR_UNREADABLE: return "MAQ_ERROR_UNREADABLE";
    case MAQ_ERROR_IMAGE_SIZE: return "MAQ_ERROR_IMAGE_SIZE";
    case MAQ_ERROR_BAD_BUNDLE: return "MAQ_ERROR_BAD_BUNDLE";
    case MAQ_ERROR_UNSUPPORTED: return "MAQ_ERROR_UNSUPPORTED";
    case MAQ_ERROR_RUNTIME_LIBRARY: return "MAQ_ERROR_RUNTIME_LIBRARY";
    case MAQ_ERROR_POOL_EMPTY: return "MAQ_ERROR_POOL_EMPTY";
    case MAQ_ERROR_INFERENCE: return "MAQ_ERROR_INFERENCE";
    case MAQ_ERROR_OUT_OF_MEMORY: return "MAQ_ERROR_OUT_OF_MEMORY";
    case MAQ_ERROR_INTERNAL: return "MAQ_ERROR_INTERNAL";
    case MAQ_END_OF_STREAM: return "MAQ_END_OF_STREAM";
    case MAQ_TIMEOUT: return "MAQ_TIMEOUT";
    case MAQ_ERROR_DEVICE_LOST: return "MAQ_ERROR_DEVICE_LOST";
    case MAQ_ERROR_BUSY: return "MAQ_ERROR_BUSY";
    case MAQ_ERROR_NO_PERMISSION: return "MAQ_ERROR_NO_PERMISSION";
    case MAQ_ERROR_UNWRITABLE: return "MAQ_ERROR_UNWRITABLE";
    case MAQ_CANCELLED: return "MAQ_CANCELLED";
  }
  return "unknown status";
}

const char* maq_last_error(const void* handle) { return last_error(static_cast<const Handle*>(handle)); }

const char* maq_get_sdk_version(void) { return sdk_version(); }
const char* maq_get_git_commit(void) { return git_commit(); }
const char* maq_get_build_options(void) { return build_options(); }

maq_status maq_context_config_init(maq_context_config* config, uint32_t struct_size) {
  return init_config(__func__, config, struct_size, default_context_config());
}

maq_status maq_context_create(uint32_t header_version, const maq_context_config* given, maq_context** context) {
  return guarded(nullptr, __func__, [&] {
    // This check comes first: with other headers, no other argument can be trusted.
    check_header_version(header_version);
    require_argument(context, "context");
    const maq_context_config config = read_config(given, "config", default_context_config());
    require_range("config.log_level", number_in(config.log_level), int32_t(MAQ_LOG_OFF), int32_t(MAQ_LOG_DEBUG));
    const maq_log_level level = config.log_level == MAQ_LOG_DEFAULT ? MAQ_LOG_WARNING : config.log_level;
    const char* library = config.onnxruntime_library;
    *context = new maq_context(std::make_shared<ContextState>(Log(level, config.log_callback, config.log_user_data),
                                                              library == nullptr ? "" : library));
    return MAQ_OK;
  });
}

void maq_context_destroy(maq_context* context) { destroy(context, "context", __func__); }

maq_status maq_context_get_onnxruntime(maq_context* context, const char** version, const char** library_path) {
  return guarded(context, __func__, [&] {
    require_argument(context, "context");
    const auto runtime = context->state->onnxruntime();
    if (version != nullptr) *version = runtime->version().c_str();
    if (library_path != nullptr) *library_path = runtime->path().c_str();
    return MAQ_OK;
  });
}
