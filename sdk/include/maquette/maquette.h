/* Maquette: an on-device vision SDK. This is the whole C API; include this file.
 *
 *   maq_context* context;      maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
 *   maq_source* source;        maq_source_create(context, "image:photo.jpg", NULL, &source);
 *   maq_densepose* densepose;  maq_densepose_create(context, &config, &densepose);
 *   maq_frame* frame;          maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
 *   maq_densepose_result* r;   maq_densepose_run(densepose, frame, &r);
 *   ... read the result ...    then release r and frame, destroy the rest, in any order.
 *
 * Rules that hold everywhere:
 * - Every call that can fail returns maq_status and writes its result through its last argument only when it returns
 *   MAQ_OK. maq_get_last_error() gives the sentence that says what was wrong and what to do.
 * - `_create` is answered by `_destroy`, `_acquire` and `_run` by `_release`; both accept NULL.
 * - Config and info structs begin with struct_size, which the caller sets to sizeof the struct; the `_init` functions
 *   do so for configs.
 * - No C++ exception leaves the library, and it never ends the process.
 * - Each function names its thread level: "any thread" may be called at any time from any thread; "one at a time" may
 *   be called from any thread, but not for the same handle from two threads at once.
 */
#ifndef MAQUETTE_MAQUETTE_H_
#define MAQUETTE_MAQUETTE_H_

#include "maquette/clip.h"
#include "maquette/context.h"
#include "maquette/densepose.h"
#include "maquette/frame.h"
#include "maquette/pipeline.h"
#include "maquette/recorder.h"
#include "maquette/scene.h"
#include "maquette/source.h"
#include "maquette/types.h"

#endif /* MAQUETTE_MAQUETTE_H_ */
