/* Prints the size of the largest box that a depth camera sees: box_size <source>, such as "stub:solids?scene=box". */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_edges* edges = NULL;
  maq_frame* frame = NULL;
  maq_edges_result* result = NULL;
  maq_edges_curves* curves = NULL;
  maq_edges_box box;
  int failed = maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK ||
               maq_edges_create(context, NULL, &edges) != MAQ_OK ||
               maq_source_create(context, argc == 2 ? argv[1] : NULL, NULL, &source) != MAQ_OK ||
               maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame) != MAQ_OK ||
               maq_edges_run(edges, frame, &result) != MAQ_OK ||
               maq_edges_result_find_curves(result, NULL, &curves) != MAQ_OK;
  if (failed) fprintf(stderr, "%s\n", maq_last_error(NULL));
  if (maq_edges_curves_get_box_count(curves) > 0) {
    box.struct_size = sizeof box;
    maq_edges_curves_get_box(curves, 0, &box);
    printf("%.0f x %.0f x %.0f mm, each within %.0f, %.0f and %.0f mm\n", 1e3 * box.size_m[0], 1e3 * box.size_m[1],
           1e3 * box.size_m[2], 1e3 * box.size_tolerance_m[0], 1e3 * box.size_tolerance_m[1],
           1e3 * box.size_tolerance_m[2]);
  } else if (!failed) {
    printf("no box\n");
  }
  maq_edges_curves_release(curves), maq_edges_result_release(result), maq_frame_release(frame);
  maq_source_destroy(source), maq_edges_destroy(edges), maq_context_destroy(context);
  return failed;
}
