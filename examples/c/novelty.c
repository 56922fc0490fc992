/* Prints the events of a clip or camera: novelty video:clip.mp4 [<bundle>] */
#include <maquette/maquette.h>
#include <stdio.h>

int main(int argc, char** argv) {
  maq_novelty_config config;
  maq_novelty_score score = {0};
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_novelty* novelty = NULL;
  maq_frame* frame = NULL;
  maq_status status;
  int frames = 0;
  if (argc < 2) {
    fprintf(stderr, "usage: novelty <source> [<bundle for prediction>]\n");
    return 2;
  }
  maq_novelty_config_init(&config, sizeof config);
  config.model.bundle_path = argc > 2 ? argv[2] : NULL;
  score.struct_size = sizeof score;
  status = maq_context_create(MAQ_HEADER_VERSION, NULL, &context);
  if (status == MAQ_OK) status = maq_source_create(context, argv[1], NULL, &source);
  if (status == MAQ_OK) status = maq_novelty_create(context, &config, &novelty);
  while (status == MAQ_OK) {
    status = maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame);
    if (status != MAQ_OK) break;
    status = maq_novelty_push(novelty, frame, &score);
    maq_frame_release(frame);
    if (status == MAQ_OK && score.is_event) {
      printf("frame %d: %s, %.1f times the bits of the frames before\n", frames, score.is_cut ? "a cut" : "an event",
             score.ratio);
    }
    ++frames;
  }
  if (status != MAQ_END_OF_STREAM) fprintf(stderr, "%s\n", maq_last_error(NULL));
  printf("%d frames\n", frames);
  maq_novelty_destroy(novelty), maq_source_destroy(source), maq_context_destroy(context);
  return status != MAQ_END_OF_STREAM;
}
