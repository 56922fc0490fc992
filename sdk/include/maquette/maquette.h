/* Maquette: an on-device vision SDK. This is the whole C API; include this file.
 *
 *   maq_context* context;      maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
 *   maq_source* source;        maq_source_create(context, "image:photo.jpg", NULL, &source);
 *   maq_densepose* densepose;  maq_densepose_create(context, NULL, &densepose);
 *   maq_frame* frame;          maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
 *   maq_densepose_result* r;   maq_densepose_run(densepose, frame, &r);
 *   ... read the result ...    then release r and frame, destroy the rest, in any order.
 *
 * Life cycle. All systems work in the same way:
 *
 *   maq_X_config_init   fills a config with the defaults
 *   maq_X_create        makes the object, loads its networks
 *   _run                takes a frame and returns a result object
 *   _push               adds the next frame of a stream
 *   _get_stats          returns times and counts
 *   _save(path)         writes the result to a file
 *   _release, _destroy  give results and objects back
 *
 *   _cancel(object) ends the running call on the object, or else the next one. Any thread may call it. The ended call
 *   returns MAQ_CANCELLED. A progress callback cancels by returning 0.
 *
 * Names.
 *
 * - Functions are maq_<object>_<verb>_<noun>. `_get_…` reads and changes nothing. `_get_<thing>_count` returns a
 *   number, `_get_<thing>(…, index, &thing)` returns one item.
 * - Types and enum values begin with the name of their system. The bounds of a range are min and max.
 * - Units are in the names: _px, _ms, _ns, _m, _bytes. Texts are UTF-8 and end with a zero byte.
 * - A parameter `count` or `capacity` after an array is the capacity of that array, in elements.
 *
 * Ownership.
 *
 * - Each function that returns an object has a partner that takes the object back. Call the partner once for each
 *   object, in any order. NULL is fine.
 *
 *     _create, _open, _open_memory, _build,   _destroy   contexts, sources, lists, models, builders, captures, scenes,
 *     _fit, _scale_…, _finish                            heads, meshes, renderers, clips, recorders
 *     _acquire_…, _run, _find_…, _load_…,     _release   frames, results and images, most from a pool of fixed size
 *     _wrap, _decode, _resize, _convert_yuv,
 *     _predict
 *
 *   The _finish of a builder returns a scene. The _finish of a clip or a recorder completes its file and returns
 *   nothing.
 * - A pointer from `_get_…` belongs to the object that it came from.
 *
 * Structs.
 *
 * - A struct with struct_size must have exactly the size of this library's struct. Set struct_size to sizeof the
 *   struct, or use the `_init` function. Headers and library of the same minor version agree on all sizes.
 * - 0 means "default" in every field of a config. "Off" is an enum value. Yes or no is an int32_t, 1 or 0; its
 *   default is 0, no. A NULL config means the defaults. Configs are copied.
 * - Each config of a system with networks begins with struct_size and `model` (maq_model_options).
 *
 * Errors.
 *
 * - Each call that can fail returns maq_status. It writes results through its pointer arguments only when it
 *   returns MAQ_OK. maq_last_error(NULL) returns a sentence with the cause and the remedy.
 * - No C++ exception leaves the library, and the library never ends the process. While the library writes, the
 *   signals of a full disk (SIGXFSZ) and of a pipe without a reader (SIGPIPE) do not end it either. Exceptions of
 *   callbacks are caught.
 * - If the system starts fewer threads than requested (ulimit -u, limits of containers), networks and renderers use
 *   the threads they get, and the log has a warning. Live sources and pipelines need one thread. Without it they
 *   return MAQ_ERROR_OUT_OF_MEMORY.
 * - Misuse returns MAQ_ERROR_INVALID_ARGUMENT where the library can detect it: an object of another type, an object
 *   that was given back before, two calls at once on a handle for one call at a time. A `_destroy` or
 *   `_release` with such an object changes nothing, and maq_last_error(NULL) says why. The library
 *   cannot detect these cases, and the behaviour is undefined:
 *
 *     - a pointer that is not from this library; an array or a buffer that is shorter than stated;
 *     - use of an object long after it was given back. For an object of a pool: after the pool has lent it again or is
 *       gone. For any other object: after 64 more objects were given back;
 *     - giving back an object while another thread uses it, in an "any thread" call or as an argument. Some functions
 *       allow it in their comment;
 *     - memory of the app that changes while a call, or a frame made by maq_frame_wrap, reads it;
 *     - a callback that does not return (longjmp, the end of its thread).
 *
 * Threads and processes.
 *
 * - Each function states its thread level. "Any thread" may be called at any time from any thread. "One at a time"
 *   may be called from any thread, but not from two threads at once for the same handle.
 * - Objects belong to the process that made them. In a child of fork() they have no threads, and their files and
 *   devices belong to the parent. Each call on such an object returns MAQ_ERROR_INVALID_ARGUMENT at once. Giving it
 *   back does nothing.
 * - A child of fork() creates its own context and objects. This works if no other thread of the parent was inside
 *   the library during fork(). After the parent has used a camera of libcamera or DepthAI, such cameras need exec()
 *   too.
 *
 * Files.
 *
 * - Saved files appear atomically, in folders that exist. A symbolic link stays, and the file behind it is
 *   replaced. A character device, a pipe or /dev/stdout receives the whole content at once. Clips and recordings
 *   need regular files.
 */
#ifndef MAQUETTE_MAQUETTE_H_
#define MAQUETTE_MAQUETTE_H_

#include "maquette/features.h"

#include "maquette/clip.h"
#include "maquette/context.h"
#include "maquette/frame.h"
#include "maquette/image.h"
#include "maquette/pipeline.h"
#include "maquette/recorder.h"
#include "maquette/source.h"
#include "maquette/types.h"
#if MAQ_HAS_DENSEPOSE
#include "maquette/densepose.h"
#include "maquette/densepose_model.h"
#include "maquette/densepose_texture.h"
#endif
#if MAQ_HAS_SCENES
#include "maquette/capture.h"
#include "maquette/dense_cloud.h"
#include "maquette/scene.h"
#endif
#if MAQ_HAS_EDGES
#include "maquette/edge_curves.h"
#include "maquette/edges.h"
#include "maquette/edges_fusion.h"
#include "maquette/edges_model.h"
#endif
#if MAQ_HAS_HEADS
#include "maquette/head.h"
#endif
#if MAQ_HAS_PREDICTION
#include "maquette/camera_health.h"
#include "maquette/concealer.h"
#include "maquette/prediction.h"
#include "maquette/prediction_model.h"
#endif
#if MAQ_HAS_BODY
#include "maquette/body.h"
#endif

#endif /* MAQUETTE_MAQUETTE_H_ */
