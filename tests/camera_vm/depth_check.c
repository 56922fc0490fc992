/* Checks frames of depth by the SDK's C API: of the virtual USB camera with --depth, or a recording of it.
 *
 *   depth_check URI FRAMES UNIT_M FOCAL_PX
 *
 * Each pixel must be that of the first plus x + 2 y units of UNIT_M metres; the intrinsics of the source must have that
 * focal length, or be unknown where it is 0. Prints one line: what was checked (exit status 0), or what was wrong (1).
 */
#include <maquette/maquette.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void must(const char* what, maq_status status, const void* handle) {
  if (status == MAQ_OK) return;
  printf("%s: %s\n", what, maq_last_error(handle));
  exit(1);
}

static double metres(const maq_frame_desc* depth, int x, int y) {
  const uint8_t* row = depth->planes[0] + (size_t)y * depth->stride_bytes[0];
  if (depth->format == MAQ_PIXEL_DEPTH16) return ((const uint16_t*)row)[x] * 0.001;
  return ((const float*)row)[x];
}

static void check_frame(const maq_frame* frame, double unit_m) {
  maq_frame_desc depth;
  double first, found, expected;
  int x, y;
  must("describe", maq_frame_desc_init(&depth, sizeof depth), NULL);
  must("depth", maq_frame_get_depth(frame, &depth), frame);
  if ((depth.format == MAQ_PIXEL_DEPTH16) != (unit_m == 0.001)) {
    printf("pixel format %d for a unit of %g m\n", (int)depth.format, unit_m);
    exit(1);
  }
  first = metres(&depth, 0, 0);
  for (y = 0; y < depth.height_px; ++y) {
    for (x = 0; x < depth.width_px; ++x) {
      found = metres(&depth, x, y);
      expected = first + (x + 2 * y) * unit_m;
      if (first < 999.9 * unit_m || fabs(found - expected) > 1e-6 * expected) {
        printf("frame %llu has %g m at (%d, %d), but must have %g\n", (unsigned long long)depth.sequence, found, x, y,
               expected);
        exit(1);
      }
    }
  }
}

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_frame* frame = NULL;
  maq_intrinsics intrinsics;
  maq_status status;
  double unit_m = argc == 5 ? atof(argv[3]) : 0, focal_px = argc == 5 ? atof(argv[4]) : 0;
  int i, frames = argc == 5 ? atoi(argv[2]) : 0;
  if (frames < 1 || unit_m <= 0) {
    fprintf(stderr, "usage: depth_check URI FRAMES UNIT_M FOCAL_PX\n");
    return 2;
  }
  must("context", maq_context_create(MAQ_HEADER_VERSION, NULL, &context), NULL);
  must("source", maq_source_create(context, argv[1], NULL, &source), context);
  status = maq_source_get_intrinsics(source, &intrinsics);
  if (focal_px == 0 ? status != MAQ_ERROR_UNSUPPORTED : status != MAQ_OK || fabs(intrinsics.fx_px - focal_px) > 0.01) {
    printf("intrinsics: status %d, focal length %g px\n", (int)status, status == MAQ_OK ? intrinsics.fx_px : 0);
    return 1;
  }
  for (i = 0; i < frames; ++i) {
    must("frame", maq_source_acquire_frame(source, 20000000000, &frame), source);
    check_frame(frame, unit_m);
    maq_frame_release(frame);
  }
  printf("%d frames of depth\n", frames);
  maq_source_destroy(source);
  maq_context_destroy(context);
  return 0;
}
