/* Builds a scene from a capture and renders it from between two photos: new_view <bundle> <capture> <out.png>. */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_capture* capture = NULL;
  maq_scene* scene = NULL;
  maq_scene_renderer* renderer = NULL;
  maq_image* image = NULL;
  maq_scene_build_config building;
  maq_scene_renderer_config rendering;
  maq_capture_view first, second;
  int failed, i;
  if (argc != 4) return fprintf(stderr, "usage: new_view <bundle> <capture> <out.png>\n"), 2;
  maq_scene_build_config_init(&building, sizeof building);
  maq_scene_renderer_config_init(&rendering, sizeof rendering);
  building.model.bundle_path = rendering.model.bundle_path = argv[1];
  first.struct_size = second.struct_size = sizeof(maq_capture_view);
  failed = maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK ||
           maq_capture_open(context, argv[2], &capture) != MAQ_OK ||
           maq_scene_build(context, &building, capture, &scene) != MAQ_OK ||
           maq_scene_renderer_create(context, &rendering, scene, &renderer) != MAQ_OK ||
           maq_capture_get_view(capture, 0, &first) != MAQ_OK || maq_capture_get_view(capture, 1, &second) != MAQ_OK;
  if (!failed) {
    /* A new viewpoint: halfway to the next photo's, in the direction of the first. */
    for (i = 0; i < 3; ++i) first.camera.centre[i] = 0.5 * (first.camera.centre[i] + second.camera.centre[i]);
    failed = maq_scene_renderer_run(renderer, &first.camera, &image) != MAQ_OK ||
             maq_image_save(image, argv[3], MAQ_IMAGE_ALPHA_OFF) != MAQ_OK;
  }
  if (failed) fprintf(stderr, "%s\n", maq_last_error(NULL));
  maq_image_release(image), maq_scene_renderer_destroy(renderer);
  maq_scene_destroy(scene), maq_capture_destroy(capture), maq_context_destroy(context);
  return failed;
}
