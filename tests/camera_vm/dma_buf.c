/* Reads a camera's frames by their dma-bufs and compares them with the planes that the SDK shows.
 *
 *   dma_buf URI FRAMES             each of so many frames, and the last once more when its source is closed
 *   dma_buf URI unplugged          the first frame when the camera was pulled out
 *
 * Prints one line: what was compared (exit status 0), or what was wrong (1).
 */
#include <maquette/maquette.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

static void must(const char* what, maq_status status, const void* handle) {
  if (status == MAQ_OK) return;
  printf("%s: %s\n", what, maq_last_error(handle));
  exit(1);
}

/* Maps the dma-buf of a frame again and returns how many of its bytes were compared. */
static size_t compare(const maq_frame* frame) {
  maq_frame_desc desc;
  const uint8_t* memory;
  int32_t fd = -1;
  size_t begin = 0, size, compared = 0;
  int plane, rows;
  must("describe", maq_frame_desc_init(&desc, sizeof desc), NULL);
  must("describe", maq_frame_get_desc(frame, &desc), frame);
  must("dma-buf", maq_frame_get_dma_buf(frame, &fd), frame);
  size = desc.stride_bytes[0] * (size_t)desc.height_px;
  if (desc.planes[1])
    size = (size_t)(desc.planes[1] - desc.planes[0]) + desc.stride_bytes[1] * (size_t)((desc.height_px + 1) / 2);
  memory = mmap(NULL, size, PROT_READ, MAP_SHARED, fd, 0);
  if (memory == MAP_FAILED) {
    perror("mmap of the dma-buf");
    exit(1);
  }
  for (plane = 0; plane < 2 && desc.planes[plane]; ++plane) {
    begin = (size_t)(desc.planes[plane] - desc.planes[0]);
    rows = plane == 0 ? desc.height_px : (desc.height_px + 1) / 2;
    if (memcmp(memory + begin, desc.planes[plane], desc.stride_bytes[plane] * (size_t)rows) != 0) {
      printf("plane %d of frame %llu differs in its dma-buf\n", plane, (unsigned long long)desc.sequence);
      exit(1);
    }
    compared += desc.stride_bytes[plane] * (size_t)rows;
  }
  munmap((void*)memory, size);
  return compared;
}

int main(int argc, char** argv) {
  maq_context* context = NULL;
  maq_source* source = NULL;
  maq_source_config config;
  maq_frame *frame = NULL, *first = NULL;
  maq_status status;
  size_t bytes = 0;
  int i, frames = argc == 3 ? atoi(argv[2]) : 0;
  if (argc != 3 || (frames < 1 && strcmp(argv[2], "unplugged") != 0)) {
    fprintf(stderr, "usage: dma_buf URI FRAMES|unplugged\n");
    return 2;
  }
  setvbuf(stdout, NULL, _IOLBF, 0);
  must("context", maq_context_create(MAQ_HEADER_VERSION, NULL, &context), NULL);
  must("config", maq_source_config_init(&config, sizeof config), NULL);
  config.reconnect_ms = MAQ_NO_RECONNECT;
  must("open", maq_source_create(context, argv[1], &config, &source), context);
  for (i = 0; i < frames; ++i) {
    maq_frame_release(frame);
    must("frame", maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame), source);
    bytes += compare(frame);
  }
  if (frames < 1) {
    must("frame", maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &first), source);
    bytes += compare(first);
    for (; (status = maq_source_acquire_frame(source, MAQ_WAIT_FOREVER, &frame)) == MAQ_OK; ++i)
      maq_frame_release(frame);
    if (status != MAQ_ERROR_DEVICE_LOST) must("unplug", status, source);
    frame = first;
  }
  maq_source_destroy(source);
  bytes += compare(frame);
  maq_frame_release(frame);
  maq_context_destroy(context);
  printf("%d frames, %zu bytes are the same in their dma-bufs\n", i, bytes);
  return 0;
}
