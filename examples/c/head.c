/* Makes a 3D head from a photo: head <photo> <mesh.glb> [<bundle of heads>]. People are found by dense pose; the head
 * of the first one is taken, or what is in the middle where there is nobody. */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_frame* frame = NULL;
  maq_densepose* densepose = NULL;
  maq_densepose_result* people = NULL;
  maq_head_builder_config config;
  maq_head_photo photo;
  maq_head_builder* builder = NULL;
  maq_head* head = NULL;
  maq_head_mesh* mesh = NULL;
  maq_head_landmark nose;
  int failed;
  if (argc < 3) {
    fprintf(stderr, "usage: head <photo> <mesh.glb> [<bundle of heads>]\n");
    return 2;
  }
  maq_head_builder_config_init(&config, sizeof config);
  maq_head_photo_init(&photo, sizeof photo);
  config.model.bundle_path = argc > 3 ? argv[3] : NULL;
  failed = maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK ||
           maq_source_create(context, argv[1], NULL, &source) != MAQ_OK ||
           maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame) != MAQ_OK ||
           maq_densepose_create(context, NULL, &densepose) != MAQ_OK ||
           maq_densepose_run(densepose, frame, &people) != MAQ_OK;
  if (!failed && maq_densepose_result_get_person_count(people) > 0) {
    maq_densepose_result_get_head_box(people, 0, photo.box_px);
  }
  failed = failed || maq_head_builder_create(context, &config, &builder) != MAQ_OK ||
           maq_head_builder_add_photo(builder, frame, &photo) != MAQ_OK ||
           maq_head_builder_fit(builder, 3.0, &head) != MAQ_OK || maq_head_mesh_create(head, NULL, &mesh) != MAQ_OK ||
           maq_head_mesh_save(mesh, argv[2]) != MAQ_OK;
  if (failed) fprintf(stderr, "%s\n", maq_last_error(NULL));
  nose.struct_size = sizeof nose;
  if (!failed && maq_head_get_landmark(head, "nose_tip", &nose) == MAQ_OK) {
    printf("%s: the nose ends %.0f mm before the middle of the head\n", argv[2], 1e3 * nose.point_m[2]);
  }
  maq_head_mesh_destroy(mesh), maq_head_destroy(head), maq_head_builder_destroy(builder),
      maq_densepose_result_release(people);
  maq_densepose_destroy(densepose), maq_frame_release(frame), maq_source_destroy(source), maq_context_destroy(context);
  return failed;
}
