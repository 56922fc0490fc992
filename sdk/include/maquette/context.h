/* The context: all other objects are created from it. It owns the log hook and the ONNX Runtime library. */
#ifndef MAQUETTE_CONTEXT_H_
#define MAQUETTE_CONTEXT_H_

#include "maquette/types.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct maq_context maq_context;

typedef enum maq_log_level {
  MAQ_LOG_OFF = -1,
  MAQ_LOG_DEFAULT = 0, /* MAQ_LOG_WARNING in this version */
  MAQ_LOG_ERROR = 1,
  MAQ_LOG_WARNING = 2,
  MAQ_LOG_INFO = 3,
  MAQ_LOG_DEBUG = 4
} maq_log_level;

/* Receives one log line without a line break. `text` is valid during the call. Any thread that calls into the library
 * may call it. It must not call back into the library and must not throw. */
typedef void (*maq_log_callback)(void* user_data, maq_log_level level, const char* text);

typedef struct maq_context_config {
  uint32_t struct_size;
  maq_log_level log_level;         /* messages above this level are not logged; default MAQ_LOG_DEFAULT */
  maq_log_callback log_callback;   /* NULL (default): nothing is logged; the SDK itself never prints */
  void* log_user_data;             /* passed to log_callback */
  const char* onnxruntime_library; /* file to open; NULL (default): searched for, see maq_context_create. Copied. */
} maq_context_config;

/* Fills `config` with the defaults and sets struct_size. `struct_size` is sizeof(maq_context_config) of the caller.
 * Any thread. Errors: MAQ_ERROR_INVALID_ARGUMENT for NULL or a size that this library does not know. Does not block. */
MAQ_API maq_status maq_context_config_init(maq_context_config* config, uint32_t struct_size);

/* Creates a context. `header_version` is MAQ_HEADER_VERSION; `config` may be NULL for the defaults.
 * The caller owns `*context`: free it with maq_context_destroy.
 * This call opens no library. ONNX Runtime is searched for when it is first needed, in this order:
 *   1. onnxruntime_library of `config`;
 *   2. the file named by the environment variable MAQ_ONNXRUNTIME_LIB;
 *   3. maquette/libonnxruntime.so.1 and libonnxruntime.so.1 in the folder of libmaquette.so;
 *   4. the system's search path.
 * It is opened privately and does not clash with the app's own copy.
 * Any thread. Errors: MAQ_ERROR_VERSION_MISMATCH, MAQ_ERROR_INVALID_ARGUMENT. Does not block. */
MAQ_API maq_status maq_context_create(uint32_t header_version, const maq_context_config* config, maq_context** context);

/* Destroys the context (NULL is fine). Objects created from it may outlive it.
 * Once for each context, from any thread. Does not block. */
MAQ_API void maq_context_destroy(maq_context* context);

/* Gets the version of the ONNX Runtime library in use ("1.26.0"), and the file it was opened from.
 * Both texts belong to the context and live as long as it does. Either pointer may be NULL.
 * Any thread. Errors: MAQ_ERROR_RUNTIME_LIBRARY. Blocks the first time, while the library is opened. */
MAQ_API maq_status maq_context_get_onnxruntime(maq_context* context, const char** version, const char** library_path);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_CONTEXT_H_ */
