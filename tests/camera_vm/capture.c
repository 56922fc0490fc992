/* Captures frames from a V4L2 camera and checks them; the plainest program that can tell a working camera from none.
 *
 *   capture DEVICE FORMAT WIDTHxHEIGHT FRAMES any|bars|gradient|unplugged
 *
 * FORMAT is a V4L2 code: YUYV, NV12, RGB3. Numbers and times of frames must rise, and the pixels be as expected:
 *   any        not looked at
 *   bars       the eight bars of vivid's pattern "100% Colorbar", without text over them
 *   gradient   the moving gradient of virtual_uvc_camera, byte for byte
 *   unplugged  the gradient, until the camera goes away with ENODEV before FRAMES are there
 * Prints one line: what was captured (exit status 0), or what was wrong (1).
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

enum { BUFFERS = 4, TIMEOUT_MS = 10000, BARS = 8 };

static void fail(const char* text, ...) {
  va_list values;
  va_start(values, text);
  vprintf(text, values);
  va_end(values);
  putchar('\n');
  exit(1);
}

static int device;

static int request(unsigned long code, void* argument) {
  int result;
  do result = ioctl(device, code, argument);
  while (result < 0 && errno == EINTR);
  return result;
}

static void must(const char* name, unsigned long code, void* argument) {
  if (request(code, argument) != 0) fail("%s: %s", name, strerror(errno));
}
#define MUST(code, argument) must(#code, code, argument)

static struct v4l2_pix_format shape;

/* Y, U, V, or R, G, B, at column x and row y. */
static void pixel_at(const uint8_t* bytes, unsigned x, unsigned y, int out[3]) {
  const uint8_t* row = bytes + (size_t)y * shape.bytesperline;
  const uint8_t* chroma;
  switch (shape.pixelformat) {
    case V4L2_PIX_FMT_YUYV:
      out[0] = row[2 * x];
      out[1] = row[4 * (x / 2) + 1];
      out[2] = row[4 * (x / 2) + 3];
      break;
    case V4L2_PIX_FMT_NV12:
      chroma = bytes + (size_t)(shape.height + y / 2) * shape.bytesperline + (x & ~1u);
      out[0] = row[x];
      out[1] = chroma[0];
      out[2] = chroma[1];
      break;
    case V4L2_PIX_FMT_RGB24:
      out[0] = row[3 * x];
      out[1] = row[3 * x + 1];
      out[2] = row[3 * x + 2];
      break;
    default: fail("Pixels of the format %.4s are not known here.", (const char*)&shape.pixelformat);
  }
}

/* White, yellow, cyan, green, magenta, red, blue, black; YUV as in BT.601 with Y from 16 to 235. */
static const int bars_yuv[BARS][3] = {{235, 128, 128}, {210, 16, 146}, {170, 166, 16}, {145, 54, 34},
                                      {106, 202, 222}, {81, 90, 240},  {41, 240, 110}, {16, 128, 128}};
static const int bars_rgb[BARS][3] = {{255, 255, 255}, {255, 255, 0}, {0, 255, 255}, {0, 255, 0},
                                      {255, 0, 255},   {255, 0, 0},   {0, 0, 255},   {0, 0, 0}};

static void check_bars(const uint8_t* bytes) {
  const int(*bars)[3] = shape.pixelformat == V4L2_PIX_FMT_RGB24 ? bars_rgb : bars_yuv;
  unsigned bar, step;
  for (bar = 0; bar < BARS; ++bar) {
    for (step = 1; step < 8; ++step) {
      unsigned x = (2 * bar + 1) * shape.width / (2 * BARS), y = step * shape.height / 8;
      int seen[3], i;
      pixel_at(bytes, x, y, seen);
      for (i = 0; i < 3; ++i) {
        if (abs(seen[i] - bars[bar][i]) > 3) { /* rounding in the driver */
          fail("The pixel %u,%u is %d,%d,%d, and bar %u should be %d,%d,%d.", x, y, seen[0], seen[1], seen[2], bar,
               bars[bar][0], bars[bar][1], bars[bar][2]);
        }
      }
    }
  }
}

static void check_gradient(const uint8_t* bytes, unsigned frame) {
  unsigned x, y;
  int start = bytes[0];
  if (start % 4 != 0) fail("Frame %u starts with %d, which is not the start of any frame.", frame, start);
  for (y = 0; y < shape.height; ++y) {
    for (x = 0; x < shape.width; ++x) {
      int seen[3], luma = (int)((unsigned)start + x + 2 * y) & 255;
      pixel_at(bytes, x, y, seen);
      if (seen[0] != luma || seen[1] != 90 || seen[2] != 160) {
        fail("Frame %u: the pixel %u,%u is %d,%d,%d and should be %d,90,160.", frame, x, y, seen[0], seen[1], seen[2],
             luma);
      }
    }
  }
}

static int went_away(unsigned frames) {
  printf("ENODEV after %u frames\n", frames);
  return 0;
}

int main(int count, char** arguments) {
  struct v4l2_format format = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
  struct v4l2_requestbuffers buffers = {
      .count = BUFFERS, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  void* memory[BUFFERS];
  const char* expected;
  unsigned width, height, frames, got, i, late = 0, last_sequence = 0;
  int64_t first_us = 0, last_us = 0;
  uint32_t code;

  if (count != 6 || strlen(arguments[2]) != 4 || sscanf(arguments[3], "%ux%u", &width, &height) != 2) {
    fprintf(stderr, "usage: capture DEVICE FORMAT WIDTHxHEIGHT FRAMES any|bars|gradient|unplugged\n");
    return 2;
  }
  memcpy(&code, arguments[2], 4);
  frames = (unsigned)atoi(arguments[4]);
  expected = arguments[5];

  device = open(arguments[1], O_RDWR | O_NONBLOCK);
  if (device < 0) fail("%s cannot be opened: %s", arguments[1], strerror(errno));
  format.fmt.pix.width = width;
  format.fmt.pix.height = height;
  format.fmt.pix.pixelformat = code;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  MUST(VIDIOC_S_FMT, &format);
  shape = format.fmt.pix;
  /* A driver takes the nearest format it has, without an error. */
  if (shape.width != width || shape.height != height || shape.pixelformat != code) {
    fail("%s gives %.4s %ux%u instead.", arguments[1], (const char*)&shape.pixelformat, shape.width, shape.height);
  }

  MUST(VIDIOC_REQBUFS, &buffers);
  if (buffers.count > BUFFERS) fail("The driver made %u buffers of %d asked for.", buffers.count, BUFFERS);
  for (i = 0; i < buffers.count; ++i) {
    struct v4l2_buffer buffer = {.index = i, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    MUST(VIDIOC_QUERYBUF, &buffer);
    memory[i] = mmap(NULL, buffer.length, PROT_READ, MAP_SHARED, device, buffer.m.offset);
    if (memory[i] == MAP_FAILED) fail("mmap: %s", strerror(errno));
    MUST(VIDIOC_QBUF, &buffer);
  }
  MUST(VIDIOC_STREAMON, &type);

  for (got = 0; got < frames; ++got) {
    struct pollfd readable = {device, POLLIN, 0};
    struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    int64_t time_us;
    if (poll(&readable, 1, TIMEOUT_MS) == 0) fail("No frame came for %d ms after %u frames.", TIMEOUT_MS, got);
    if (request(VIDIOC_DQBUF, &buffer) != 0) {
      if (errno == ENODEV && got > 0 && strcmp(expected, "unplugged") == 0) return went_away(got);
      fail("VIDIOC_DQBUF after %u frames: %s", got, strerror(errno));
    }
    /* A frame cut off by the unplugging comes out marked as damaged, and ENODEV after it. */
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) && strcmp(expected, "unplugged") == 0) continue;
    if (buffer.flags & V4L2_BUF_FLAG_ERROR) fail("Frame %u is marked as damaged.", got);
    if (buffer.bytesused != shape.sizeimage) {
      fail("Frame %u has %u bytes of %u.", got, buffer.bytesused, shape.sizeimage);
    }
    time_us = (int64_t)buffer.timestamp.tv_sec * 1000000 + buffer.timestamp.tv_usec;
    if (got == 0) {
      first_us = time_us;
    } else if (buffer.sequence < last_sequence && time_us < last_us && ++late <= frames / 5) {
      /* uvcvideo copies frames side by side: under load one is done after the next. */
      printf("frame %u came after frame %u\n", buffer.sequence, last_sequence);
      MUST(VIDIOC_QBUF, &buffer);
      --got;
      continue;
    } else if (buffer.sequence <= last_sequence || time_us <= last_us) {
      fail("Frame %u has the number %u after %u, and came %lld us after the one before.", got, buffer.sequence,
           last_sequence, (long long)(time_us - last_us));
    }
    last_sequence = buffer.sequence;
    last_us = time_us;
    if (strcmp(expected, "bars") == 0) {
      check_bars(memory[buffer.index]);
    } else if (strcmp(expected, "any") != 0) {
      check_gradient(memory[buffer.index], got);
    }
    if (request(VIDIOC_QBUF, &buffer) != 0) {
      /* It may go away between the two calls as well. */
      if (errno == ENODEV && strcmp(expected, "unplugged") == 0) return went_away(got + 1);
      fail("VIDIOC_QBUF after %u frames: %s", got + 1, strerror(errno));
    }
  }
  if (strcmp(expected, "unplugged") == 0) fail("The camera was still there after %u frames.", frames);
  MUST(VIDIOC_STREAMOFF, &type);
  printf("%u frames in %.2f s, the last with number %u\n", got, (double)(last_us - first_us) / 1e6, last_sequence);
  return 0;
}
