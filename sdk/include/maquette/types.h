/* Status codes, error text, version, and declarations that all other headers use. */
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
#define MAQ_VERSION_MINOR 3
#define MAQ_VERSION_PATCH 0

/* The version of these headers as one number, major * 10000 + minor * 100 + patch. An app passes it to
 * maq_context_create, which refuses headers that do not fit the library it finds at run time. */
#define MAQ_HEADER_VERSION (MAQ_VERSION_MAJOR * 10000 + MAQ_VERSION_MINOR * 100 + MAQ_VERSION_PATCH)

#ifdef __cplusplus
extern "C" {
#endif

/* The outcome of a call. Values never change meaning; new ones are added at the end. */
typedef enum maq_status {
  MAQ_OK = 0,
  MAQ_ERROR_INVALID_ARGUMENT = 1, /* a NULL, an out-of-range value, a wrong struct_size, an ill-formed URI */
  MAQ_ERROR_VERSION_MISMATCH = 2, /* the app's headers do not fit this library */
  MAQ_ERROR_NOT_FOUND = 3,        /* the file, folder or item that a call asks for does not exist */
  MAQ_ERROR_UNREADABLE = 4,       /* a file is there but cannot be decoded: damaged, truncated or another format */
  MAQ_ERROR_IMAGE_SIZE = 5,       /* an image has no pixels, or more than the limits in frame.h */
  MAQ_ERROR_BAD_BUNDLE = 6,       /* a model bundle is incomplete or changed, or contradicts its manifest */
  MAQ_ERROR_UNSUPPORTED = 7,      /* this build or version cannot do it: unknown URI scheme, pixel format */
  MAQ_ERROR_RUNTIME_LIBRARY = 8,  /* ONNX Runtime: not found, cannot be opened, or too old; clips: no ffmpeg */
  MAQ_ERROR_POOL_EMPTY = 9,       /* every frame or result of the pool is still held: release one */
  MAQ_ERROR_INFERENCE = 10,       /* a network failed to run */
  MAQ_ERROR_OUT_OF_MEMORY = 11,   /* no memory, or no thread or event is left: limits of the user or the container */
  MAQ_ERROR_INTERNAL = 12,        /* a defect of the library; please report it */
  MAQ_END_OF_STREAM = 13,         /* not an error: the source has no more frames */
  MAQ_TIMEOUT = 14,               /* not an error: no frame or result came within the timeout */
  MAQ_ERROR_DEVICE_LOST = 15,     /* a camera was unplugged, or broke, and did not come back in time */
  MAQ_ERROR_BUSY = 16,            /* another program has the camera */
  MAQ_ERROR_NO_PERMISSION = 17,   /* the user may not open the camera */
  MAQ_ERROR_UNWRITABLE = 18,      /* a file cannot be created or written: it exists already, the disk is full */
  MAQ_CANCELLED = 19              /* not an error: the app cancelled the call */
} maq_status;

/* For maq_model_options.threads: the number of threads is measured when the networks are created. One network runs on
 * zeros with 1, 2, ... threads, up to the default number. The smallest number within 5 % of the fastest time is kept,
 * because more threads would only cost energy. This takes up to half a second, more for large networks. */
#define MAQ_THREADS_MEASURED (-1)

/* The library that runs the layers of a network. Values never change meaning; new ones are added at the end. */
typedef enum maq_provider {
  MAQ_PROVIDER_CPU = 0,     /* default: ONNX Runtime's own kernels */
  MAQ_PROVIDER_XNNPACK = 1, /* XNNPACK on the CPU, for networks of floats */
  MAQ_PROVIDER_NNAPI = 2    /* accelerators of an Android device; may be slower than the CPU: measure it */
} maq_provider;

/* A file in the app's memory, for systems without a file system (phones, browsers). The call that takes it copies it:
 * name and data may be freed when the call returns. */
typedef struct maq_memory_file {
  const char* name; /* as in the folder: "manifest.json", "trunk.onnx" */
  const void* data;
  size_t size_bytes;
} maq_memory_file;

/* How the networks of a system are loaded and run. Each config of a system with networks has this member. All zero is
 * the default. The bundle is a folder with manifest.json, or the files of this folder in memory. Set one of the two. If
 * neither is set, the bundle installed with the library is used. Paths and files are copied. */
typedef struct maq_model_options {
  int32_t threads;       /* 1 to 64; 0: the machine's large cores, at most 4; MAQ_THREADS_MEASURED: measured */
  maq_provider provider; /* default MAQ_PROVIDER_CPU. The CPU replaces a provider that is missing or that takes less
                            than half of the network; the log says why. */
  uint32_t bundle_file_count;          /* default 0 */
  const char* bundle_path;             /* folder with manifest.json; default NULL */
  const maq_memory_file* bundle_files; /* the bundle's files in memory; default NULL */
} maq_model_options;

/* Receives the progress of a long call, on the thread of that call. `done` is the finished fraction, 0 to 1. `stage` is
 * a sentence about the current step; it is valid during the callback. `user_data` is the config's progress_user_data.
 * Return 0 to cancel the call, which then returns MAQ_CANCELLED; return anything else to continue. The callback must
 * not use the object that calls it, except for its `_cancel`, and must not throw. */
typedef int32_t (*maq_progress_callback)(void* user_data, double done, const char* stage);

/* Returns the status as written in the enum ("MAQ_ERROR_NOT_FOUND"), "unknown status" for other values.
 * The text is static. Any thread. Does not fail or block. */
MAQ_API const char* maq_status_get_name(maq_status status);

/* Returns a sentence with the cause of an error and its remedy. With NULL: for the latest failed call of this thread,
 * with or without a handle. With a handle: for the latest failed call on that handle, on any thread. Returns "" if no
 * call failed. A failure to create an object counts as a call on the context. Calls that succeed do not clear the text.
 * The text is the library's and stays valid until this thread calls maq_last_error again.
 * Any thread, while `handle` is alive. Does not fail or block. */
MAQ_API const char* maq_last_error(const void* handle);

/* Return the version of the library found at run time ("0.3.0"), its git commit, and its build options
 * ("release, g++ 12.2"). The texts are static. Any thread. Do not fail or block. */
MAQ_API const char* maq_get_sdk_version(void);
MAQ_API const char* maq_get_git_commit(void);
MAQ_API const char* maq_get_build_options(void);

#ifdef __cplusplus
}
#endif

#endif /* MAQUETTE_TYPES_H_ */
