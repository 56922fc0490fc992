/* Takes frames of a camera by the SDK's C API and checks them.
 *
 *   source_check URI FRAMES gradient     frames are YUYV with the moving gradient of virtual_uvc_camera, byte for byte
 *   source_check URI FRAMES lost         ... until the camera goes away for good before FRAMES are there
 *   source_check URI FRAMES back         ... FRAMES of them after it went away and came back
 *   source_check URI VALUE  brightness   the control is set, and some frames are taken for it to reach the camera
 *
 * While a camera streams it is listed, and no other program can open it. Numbers and times of frames must rise, and
 * times be of the monotonic clock. A frame's dma-buf must show the same bytes as its planes, and the last frame stay
 * readable when the source is gone. Prints one line: what was taken (exit status 0), or what was wrong (1).
 */
#define _GNU_SOURCE
#include <maquette/maquette.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>

static void fail(const char* text, ...) {
  va_list values;
  va_start(values, text);
  vprintf(text, values);
  va_end(values);
  putchar('\n');
  exit(1);
}

static int64_t now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void check_gradient(const maq_frame_desc* frame) {
  int x, y, start = frame->planes[0][0];
  if (frame->format != MAQ_PIXEL_YUYV) fail("The frame is of format %d and not YUYV.", frame->format);
  if (start % 4 != 0) fail("A frame starts with %d, which is not the start of any frame.", start);
  for (y = 0; y < frame->height_px; ++y) {
    const uint8_t* row = frame->planes[0] + (size_t)y * frame->stride_bytes[0];
    for (x = 0; x < frame->width_px; ++x) {
      int luma = (start + x + 2 * y) & 255, chroma = x % 2 == 0 ? 90 : 160;
      if (row[2 * x] != luma || row[2 * x + 1] != chroma) {
        fail("The pixel %d,%d is %d,%d and should be %d,%d.", x, y, row[2 * x], row[2 * x + 1], luma, chroma);
      }
    }
  }
}

static void check_dma_buf(const maq_frame* frame, const maq_frame_desc* desc) {
  size_t bytes = desc->stride_bytes[0] * (size_t)desc->height_px;
  int32_t fd = -1;
  void* memory;
  if (maq_frame_get_dma_buf(frame, &fd) != MAQ_OK) fail("A frame has no dma-buf: %s", maq_last_error(frame));
  memory = mmap(NULL, bytes, PROT_READ, MAP_SHARED, fd, 0);
  if (memory == MAP_FAILED) fail("A frame's dma-buf cannot be mapped.");
  if (memcmp(memory, desc->planes[0], bytes) != 0) fail("A frame's dma-buf shows something else than its pixels.");
  munmap(memory, bytes);
}

/* Neither disturbs the frames that follow. */
static void check_others(maq_context* context, const char* uri) {
  maq_source* second = NULL;
  maq_camera_list* list = NULL;
  maq_status status = maq_source_create(context, uri, NULL, &second);
  if (status != MAQ_ERROR_BUSY) fail("Opened twice, it gives status %d and not MAQ_ERROR_BUSY.", status);
  if (maq_camera_list_create(context, &list) != MAQ_OK) fail("%s", maq_last_error(context));
  if (maq_camera_list_get_count(list) == 0) fail("A camera that streams is not listed.");
  maq_camera_list_destroy(list);
}

static atomic_int times_back;

static void note_state(void* user_data, maq_source_state state, const char* reason) {
  (void)user_data;
  fprintf(stderr, "state %d: %s\n", state, reason);
  if (state == MAQ_SOURCE_RECONNECTED) atomic_fetch_add(&times_back, 1);
}

int main(int count, char** arguments) {
  maq_context* context = NULL;
  maq_source_config config;
  maq_source* source = NULL;
  maq_frame* frame = NULL;
  maq_frame_desc desc;
  uint64_t last_sequence = 0;
  int64_t last_ns = 0;
  int frames, got, all = 0, is_lost, is_back, is_brightness;

  if (count != 4) {
    fprintf(stderr, "usage: source_check URI FRAMES|VALUE gradient|lost|back|brightness\n");
    return 2;
  }
  is_lost = strcmp(arguments[3], "lost") == 0;
  is_back = strcmp(arguments[3], "back") == 0;
  is_brightness = strcmp(arguments[3], "brightness") == 0;
  frames = is_brightness ? 10 : atoi(arguments[2]);
  if (maq_context_create(MAQ_HEADER_VERSION, NULL, &context) != MAQ_OK) fail("no context");
  maq_source_config_init(&config, sizeof config);
  config.reconnect_ms = is_back ? 20000 : 1000;
  config.state_callback = note_state;
  if (maq_source_create(context, arguments[1], &config, &source) != MAQ_OK) fail("%s", maq_last_error(context));
  if (is_brightness) {
    maq_source_control_info info;
    info.struct_size = sizeof info;
    if (maq_source_set_control(source, MAQ_SOURCE_CONTROL_BRIGHTNESS, atof(arguments[2])) != MAQ_OK ||
        maq_source_get_control(source, MAQ_SOURCE_CONTROL_BRIGHTNESS, &info) != MAQ_OK) {
      fail("%s", maq_last_error(source));
    }
    if (info.value != atof(arguments[2])) fail("The brightness is %g after it was set.", info.value);
    if (maq_source_set_control(source, MAQ_SOURCE_CONTROL_BRIGHTNESS, 100) != MAQ_ERROR_INVALID_ARGUMENT) {
      fail("A brightness of 100 is none.");
    }
    if (maq_source_set_control(source, MAQ_SOURCE_CONTROL_FOCUS, 1) != MAQ_ERROR_UNSUPPORTED)
      fail("There is no focus.");
  }
  for (got = 0; got < frames; ++all) {
    maq_status status;
    maq_frame_release(frame); /* the last one is still held when the loop ends */
    frame = NULL;
    status = maq_source_acquire_frame(source, 20000000000, &frame);
    if (is_lost && status == MAQ_ERROR_DEVICE_LOST && all > 0) {
      printf("after %d frames: %s\n", all, maq_last_error(source));
      maq_source_destroy(source);
      maq_context_destroy(context);
      return 0;
    }
    if (status != MAQ_OK) fail("after %d frames: %s", all, maq_last_error(source));
    desc.struct_size = sizeof desc;
    if (maq_frame_get_desc(frame, &desc) != MAQ_OK) fail("%s", maq_last_error(frame));
    if (desc.clock != MAQ_CLOCK_MONOTONIC || desc.timestamp_ns > now_ns() ||
        desc.timestamp_ns < now_ns() - 5000000000) {
      fail("Frame %d is of %lld ns at %lld ns.", all, (long long)desc.timestamp_ns, (long long)now_ns());
    }
    if (all > 0 && (desc.sequence <= last_sequence || desc.timestamp_ns <= last_ns)) {
      fail("Frame %d has the number %llu after %llu, and came %lld ns after the one before.", all,
           (unsigned long long)desc.sequence, (unsigned long long)last_sequence,
           (long long)(desc.timestamp_ns - last_ns));
    }
    last_sequence = desc.sequence;
    last_ns = desc.timestamp_ns;
    check_gradient(&desc);
    check_dma_buf(frame, &desc);
    if (all == 0 && strcmp(arguments[3], "gradient") == 0) check_others(context, arguments[1]);
    if (!is_back || atomic_load(&times_back) > 0) ++got;
  }
  if (is_lost) fail("The camera was still there after %d frames.", frames);
  maq_source_destroy(source);
  check_gradient(&desc);
  check_dma_buf(frame, &desc);
  maq_frame_release(frame);
  maq_context_destroy(context);
  printf("%d frames of %dx%d, the last with number %llu\n", all, desc.width_px, desc.height_px,
         (unsigned long long)last_sequence);
  return 0;
}
