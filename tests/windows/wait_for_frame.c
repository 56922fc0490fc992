/* A program of Windows in C: links maquette.dll, and waits for frames of a live source by the source's event. */
#include <maquette/maquette.h>
#include <stdio.h>
#include <windows.h>

static int failed(const char* what) {
  printf("%s: %s\n", what, maq_last_error(NULL));
  return 1;
}

int main(void) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  int32_t event = -1;
  int frames;
  if (maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK) return failed("context");
  if (maq_source_create(context, "stub:pattern?live=1&fps=30", NULL, &source) != MAQ_OK) return failed("source");
  if (maq_source_get_event_fd(source, &event) != MAQ_OK) return failed("event");
  for (frames = 0; frames < 10;) {
    maq_frame* frame = NULL;
    maq_status status = maq_source_acquire_frame(source, 0, &frame);
    if (status == MAQ_OK) {
      maq_frame_release(frame);
      ++frames;
    } else if (status != MAQ_TIMEOUT) {
      return failed("frame");
    } else if (WaitForSingleObject((HANDLE)(intptr_t)event, 5000) != WAIT_OBJECT_0) {
      return failed("no frame in 5 s");
    }
  }
  maq_source_stop(source);
  if (WaitForSingleObject((HANDLE)(intptr_t)event, 0) != WAIT_OBJECT_0) return failed("stopped without an event");
  maq_source_destroy(source);
  maq_context_destroy(context);
  printf("%d frames\n", frames);
  return 0;
}
