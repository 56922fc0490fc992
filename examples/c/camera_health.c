/* Prints what happens to the camera of a clip or stream: camera_health video:clip.mp4 */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_camera_health_result result = {0};
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_camera_health* health = NULL;
  maq_frame* frame = NULL;
  maq_status status;
  int frames = 0;
  if (argc < 2) {
    fprintf(stderr, "usage: camera_health <source>\n");
    return 2;
  }
  result.struct_size = sizeof result;
  status = maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
  if (status == MAQ_OK) status = maq_source_create(context, argv[1], NULL, &source);
  if (status == MAQ_OK) status = maq_camera_health_create(context, &health);
  while (status == MAQ_OK) {
    status = maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
    if (status != MAQ_OK) break;
    status = maq_camera_health_push(health, frame, &result);
    maq_frame_release(frame);
    if (status == MAQ_OK && result.event != MAQ_CAMERA_OK) {
      printf("frame %d: %s\n", frames, maq_camera_event_get_name(result.event));
    }
    ++frames;
  }
  if (status != MAQ_END_OF_STREAM) fprintf(stderr, "%s\n", maq_last_error(NULL));
  printf("%d frames\n", frames);
  maq_camera_health_destroy(health), maq_source_destroy(source), maq_context_destroy(context);
  return status != MAQ_END_OF_STREAM;
}
