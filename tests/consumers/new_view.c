/* Makes a scene of a captured place and a picture of it from between two photos: new_view <networks> <capture> <out.ppm>. */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_capture* capture = NULL;
  maq_scene* scene = NULL;
  maq_scene_renderer* renderer = NULL;
  maq_scene_image* image = NULL;
  maq_scene_build_config building;
  maq_scene_renderer_config rendering;
  maq_capture_view first, second;
  const unsigned char* bgr = NULL;
  size_t stride = 0;
  int failed, x, y;
  if (argc != 4) return fprintf(stderr, "usage: new_view <networks> <capture> <out.ppm>\n"), 2;
  maq_scene_build_config_init(&building, sizeof building);
  maq_scene_renderer_config_init(&rendering, sizeof rendering);
  building.bundle_path = rendering.bundle_path = argv[1];
  first.struct_size = second.struct_size = sizeof(maq_capture_view);
  first.camera.struct_size = second.camera.struct_size = sizeof(maq_pinhole_camera);
  failed = maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK ||
           maq_capture_open(context, argv[2], &capture) != MAQ_OK ||
           maq_scene_build(context, &building, capture, NULL, &scene) != MAQ_OK ||
           maq_scene_renderer_create(context, &rendering, scene, &renderer) != MAQ_OK;
  if (failed) fprintf(stderr, "%s\n", maq_get_last_error(context));
  if (!failed) {
    /* Where nobody took a photo: halfway to the next one's place, looking as the first does. */
    maq_capture_get_view(capture, 0, &first);
    maq_capture_get_view(capture, 1, &second);
    for (x = 0; x < 3; ++x) first.camera.centre[x] = 0.5 * (first.camera.centre[x] + second.camera.centre[x]);
    failed = maq_scene_renderer_run(renderer, &first.camera, &image) != MAQ_OK ||
             maq_scene_image_get_plane(image, MAQ_SCENE_PLANE_BGR, (const void**)&bgr, &stride) != MAQ_OK;
    if (failed) fprintf(stderr, "%s\n", maq_get_last_error(renderer));
  }
  if (!failed) {
    FILE* file = fopen(argv[3], "wb");
    failed = file == NULL;
    if (failed) perror(argv[3]);
    if (file) fprintf(file, "P6 %d %d 255\n", first.camera.width_px, first.camera.height_px);
    for (y = 0; file && y < first.camera.height_px; ++y) {
      for (x = 0; x < first.camera.width_px; ++x) {
        const unsigned char* pixel = bgr + (size_t)y * stride + 3 * (size_t)x;
        putc(pixel[2], file), putc(pixel[1], file), putc(pixel[0], file);
      }
    }
    if (file) fclose(file);
  }
  maq_scene_image_release(image), maq_scene_renderer_destroy(renderer);
  maq_scene_close(scene), maq_capture_close(capture), maq_context_destroy(context);
  return failed;
}
