/* Maquette: an on-device vision SDK. This is the whole C API; include this file.
 *
 *   maq_context* context;      maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
 *   maq_source* source;        maq_source_create(context, "image:photo.jpg", NULL, &source);
 *   maq_densepose* densepose;  maq_densepose_create(context, NULL, &densepose);
 *   maq_frame* frame;          maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
 *   maq_densepose_result* r;   maq_densepose_run(densepose, frame, &r);
 *   ... read the result ...    then release r and frame, destroy the rest, in any order.
 *
 * Rules of the whole API:
 *
 * - Names are maq_<object>_<verb>_<noun>. `_get_…` reads and changes nothing: `_get_<thing>_count` returns a number,
 *   `_get_<thing>(…, index, &thing)` one item. Enum values begin with the noun of their type; bounds are min and max.
 * - Each verb that returns an object is paired with one that gives the object back. Call it once for each object, in
 *   any order; NULL is fine:
 *
 *     _create, _open, _open_memory, _build,   _destroy   contexts, sources, lists, models, builders, captures, scenes,
 *     _fit, _scale_…, _finish                            heads, meshes, renderers, writers
 *     _acquire_…, _run, _find_…, _load_…,     _release   frames, results and images, most from a pool of fixed size
 *     _wrap, _decode, _resize, _convert_yuv,
 *     _predict
 *
 *   (_finish of a builder returns a scene; _finish of a clip or a recorder completes its file and returns nothing.)
 *   What `_get_…` returns belongs to the object that it was called with.
 * - Every call that can fail returns maq_status and writes its result through its last argument only when it returns
 *   MAQ_OK. maq_last_error(NULL) is the sentence that says what was wrong and what to do.
 * - Structs that may grow begin with struct_size, which the caller sets to sizeof the struct; the `_init` functions do
 *   so and fill in the defaults. A NULL config means the defaults. Configs are copied.
 * - Yes or no is an int32_t, 1 or 0. Fields and parameters with values of an enum have the enum's
 *   type, 4 bytes.
 * - Units are in the names: _px, _ms, _ns, _m, _bytes. Texts are UTF-8 and end with a zero byte.
 * - Files that are saved appear atomically, in folders that exist. Of a symbolic link, the file that it leads
 *   to is replaced; a character device, a pipe or /dev/stdout gets the whole at once (clips and recordings need files).
 * - No C++ exception leaves the library, and it never ends the process: nor do the signals of a full disk or of a pipe
 *   without a reader (SIGXFSZ, SIGPIPE) while it writes. What a callback throws is caught.
 * - Where the system starts fewer threads than asked for (ulimit -u, limits of containers), networks and renderers run
 *   on those there are, with a warning in the log; live sources and pipelines, which need one, return
 *   MAQ_ERROR_OUT_OF_MEMORY.
 * - Objects belong to the process that made them. In a child of fork() they have no threads, and their files and
 *   devices are the parent's: each call on one returns MAQ_ERROR_INVALID_ARGUMENT at once, and giving it back does
 *   nothing. A child makes a context and all else anew; that works if no other thread of the parent was in a call of
 *   the library during fork(). Cameras of libcamera and DepthAI need exec() too once the parent has used one.
 * - Each function names its thread level: "any thread" may be called at any time from any thread; "one at a time" may
 *   be called from any thread, but not for the same handle from two threads at once.
 * - Misuse is MAQ_ERROR_INVALID_ARGUMENT where the library can see it: an object of another type, one that was given
 *   back before, two calls at once on an object whose functions run one at a time, also from a callback of the first.
 *   A `_destroy` or `_release` for which that holds changes nothing, and maq_last_error(NULL) says why. The
 *   library cannot see, and the behaviour is undefined for:
 *
 *     - a pointer that is not of this library; a shorter array or buffer than was said;
 *     - an object that was given back so long ago that its memory has become another's: those of a pool until the pool
 *       lends them again, or is gone, and the latest 64 others are remembered;
 *     - an object that is given back while a call of "any thread" level uses it, or a call to which it is an argument,
 *       on another thread, unless the function's comment allows it;
 *     - memory of the app that changes while a call, or a frame made by maq_frame_wrap, reads it;
 *     - a callback that does not return (longjmp, the end of its thread).
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
#endif
#if MAQ_HAS_SCENES
#include "maquette/capture.h"
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
#include "maquette/concealer.h"
#include "maquette/novelty.h"
#include "maquette/prediction.h"
#include "maquette/prediction_model.h"
#endif

#endif /* MAQUETTE_MAQUETTE_H_ */
