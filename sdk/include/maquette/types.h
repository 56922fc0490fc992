/* Status codes, error text and version: what every other header of Maquette uses. */
#ifndef MAQUETTE_TYPES_H_
#define MAQUETTE_TYPES_H_

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#if defined(MAQ_BUILDING_LIBRARY)
#define MAQ_API __declspec(dllexport)
#else
#define MAQ_API __declspec(dllimport)
#endif
#else
#define MAQ_API __attribute__((visibility("default")))
#endif

#define MAQ_VERSION_MAJOR 0
#define MAQ_VERSION_MINOR 2
#define MAQ_VERSION_PATCH 0

/* The version of these headers as one number, major * 10000 + minor * 100 + patch. An app passes it to
 * maq_context_create, which refuses headers that do not fit the library it finds at run time. */
#define MAQ_HEADER_VERSION (MAQ_VERSION_MAJOR * 10000 + MAQ_VERSION_MINOR * 100 + MAQ_VERSION_PATCH)

#ifdef __cplusplus
extern "C" {
#endif

/* What a call came to. Values never change meaning; new ones are added at the end. */
typedef enum maq_status {
  MAQ_OK = 0,
  MAQ_ERROR_INVALID_ARGUMENT = 1, /* a NULL, an out-of-range value, a wrong struct_size, an ill-formed URI */
  MAQ_ERROR_VERSION_MISMATCH = 2, /* the app's headers do not fit this library */
  MAQ_ERROR_NOT_FOUND = 3,        /* a file or folder is not there */
  MAQ_ERROR_UNREADABLE = 4,       /* a file is there but cannot be decoded: damaged, truncated or another format */
  MAQ_ERROR_IMAGE_SIZE = 5,       /* an image has no pixels, or more than the limits in frame.h */
  MAQ_ERROR_BAD_BUNDLE = 6,       /* a model bundle is incomplete, changed, or not what its manifest says */
  MAQ_ERROR_UNSUPPORTED = 7,      /* this build or version cannot do it: unknown URI scheme, pixel format */
  MAQ_ERROR_RUNTIME_LIBRARY = 8,  /* ONNX Runtime or libmaquette_files.so: not found, cannot be opened, or too old */
  MAQ_ERROR_POOL_EMPTY = 9,       /* every frame or result of the pool is still held: release one */
  MAQ_ERROR_INFERENCE = 10,       /* a network failed to run */
  MAQ_ERROR_OUT_OF_MEMORY = 11,
  MAQ_ERROR_INTERNAL = 12,      /* a defect of the library; please report it */
  MAQ_END_OF_STREAM = 13,       /* not an error: the source has no more frames */
  MAQ_TIMEOUT = 14,             /* not an error: no frame came in the time that was given */
  MAQ_ERROR_DEVICE_LOST = 15,   /* a camera was unplugged, or broke, and did not come back in time */
  MAQ_ERROR_BUSY = 16,          /* another program has the camera */
  MAQ_ERROR_NO_PERMISSION = 17, /* the user may not open the camera */
  MAQ_ERROR_UNWRITABLE = 18,    /* a file cannot be made or written: it is there already, the disk is full */
  MAQ_CANCELLED = 19            /* not an error: the app ended the call before its time */
} maq_status;

/* The status as written in the enum ("MAQ_ERROR_NOT_FOUND"), "unknown status" for other values.
 * The text is static. Any thread. Does not fail or block. */
MAQ_API const char* maq_status_get_name(maq_status status);

/* The text of the latest failed call on `handle` (any handle of this API), as one sentence; "" when none failed.
 * With NULL: of this thread's latest failed call that had no handle yet (a `_create`, or a NULL handle).
 * The text is the library's; it stays until this thread calls maq_get_last_error again. Calls that succeed do not clear it.
 * Any thread, as long as `handle` is alive. Does not fail or block. */
MAQ_API const char* maq_get_last_error(const void* handle);

/* Version of the library found at run time ("0.2.0"), the git commit it was built from, and the options it was built
 * with ("release, g++ 12.2, opencv 4.6.0"). Static text. Any thread. Do not fail or block. */
MAQ_API const char* maq_get_sdk_version(void);
MAQ_API const char* maq_get_git_commit(void);
MAQ_API const char* maq_get_build_options(void);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_TYPES_H_ */
