/* A USB camera without hardware: a UVC 1.0 camera with bulk transfers, which the kernel's vhci-hcd driver plugs in.
 *
 *   virtual_uvc_camera [--port N] [--seconds N] [--picture FILE] [--jpeg FILE] [--depth]
 *
 * vhci-hcd is the client side of USB/IP: it takes a connected socket and speaks of each USB transfer over it. Here the
 * other end of a socket pair answers, so no network is needed, and the camera is unplugged the moment this process
 * ends, for whatever reason. Started again, it is plugged in again.
 *
 * Frames are YUYV of 640x480 or 320x240 at 30 per second. Without --picture they are a moving gradient: Y is (x + 2 y +
 * 4 frame) mod 256, U is 90, V is 160, and frames count from 0 at each start of the stream. --picture is a raw YUYV
 * picture of 640x480. --jpeg adds the format MJPEG, 640x480, whose every frame is that file. With --depth it is a depth
 * camera: in place of YUYV it has 16 bits of depth a pixel, 1000 + x + 2 y + 4 (frame mod 1000).
 *
 * Sources: USB 2.0, chapter 9; USB Device Class Definition for Video Devices 1.0a ("UVC" below); Linux,
 * Documentation/usb/usbip_protocol.rst, and include/linux/usb/uvc.h for the format that it calls Z16. Runs on
 * little-endian machines only, as USB numbers are little-endian.
 */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum {
  FRAMES_PER_SECOND = 30,
  FRAME_INTERVAL_100NS = 10000000 / FRAMES_PER_SECOND,
  LARGEST_WIDTH = 640,
  LARGEST_HEIGHT = 480,
  LARGEST_FRAME_BYTES = LARGEST_WIDTH * LARGEST_HEIGHT * 2,
  PAYLOAD_BYTES = 16384, /* the most in one bulk transfer, with its header */
  PAYLOAD_HEADER_BYTES = 2,
};

/* ---------------------------------------------------------------------------------------------------- what it shows */

enum { FORMAT_YUYV = 1, FORMAT_MJPEG = 2 }; /* bFormatIndex */

static const struct {
  int width, height;
} sizes[] = {{640, 480}, {320, 240}}; /* bFrameIndex is the place here, from 1; MJPEG has the first one only */

static uint8_t* picture; /* YUYV of the largest size, or NULL for the gradient */
static int shows_depth;
static uint8_t* jpeg;
static size_t jpeg_bytes;

static struct {
  int format, size; /* as committed: FORMAT_..., index into `sizes` */
  unsigned number;  /* of the frame in the stream */
  size_t sent;      /* bytes of it that went out */
  int64_t due_ns;   /* when the next frame may start */
  uint8_t bytes[LARGEST_FRAME_BYTES];
  size_t length;
} frame = {FORMAT_YUYV, 0, 0, 0, 0, {0}, 0};

static int64_t now_ns(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void draw_frame(void) {
  int width = sizes[frame.size].width, height = sizes[frame.size].height;
  int step = LARGEST_WIDTH / width; /* a small picture takes every second pair of pixels of every second row */
  int x, y;
  uint8_t* out = frame.bytes;
  if (frame.format == FORMAT_MJPEG) {
    memcpy(frame.bytes, jpeg, jpeg_bytes);
    frame.length = jpeg_bytes;
    return;
  }
  frame.length = (size_t)width * height * 2;
  for (y = 0; y < height && shows_depth; ++y) {
    for (x = 0; x < width; ++x, out += 2) {
      unsigned depth = 1000 + x + 2 * y + 4 * (frame.number % 1000);
      out[0] = (uint8_t)depth;
      out[1] = (uint8_t)(depth >> 8);
    }
  }
  for (y = 0; y < height && !shows_depth; ++y) {
    for (x = 0; x < width; x += 2, out += 4) {
      if (picture) {
        memcpy(out, picture + ((size_t)y * step * LARGEST_WIDTH + (size_t)x * step) * 2, 4);
      } else {
        unsigned luma = x + 2 * y + 4 * frame.number;
        out[0] = (uint8_t)luma;
        out[1] = 90;
        out[2] = (uint8_t)(luma + 1);
        out[3] = 160;
      }
    }
  }
}

static void restart_stream(int format, int size) {
  frame.format = format;
  frame.size = size;
  frame.number = 0;
  frame.sent = 0;
  frame.due_ns = now_ns();
}

/* ------------------------------------------------------------------------------------------------- its descriptors */

#define LE16(x) (x) & 255, ((x) >> 8) & 255
#define LE32(x) (x) & 255, ((x) >> 8) & 255, ((x) >> 16) & 255, ((x) >> 24) & 255

enum { CONTROL_INTERFACE = 0, STREAMING_INTERFACE = 1, PROCESSING_UNIT = 2, STREAM_ENDPOINT = 0x81 };

/* Vendor and product of Linux's own webcam gadget (drivers/usb/gadget/legacy/webcam.c). The class EF/2/1 says that
 * interfaces belong together, which an interface association descriptor tells (USB ECN). */
static const uint8_t device_descriptor[18] = {
    18, 1, LE16(0x0200), 0xEF, 2, 1, 64, LE16(0x1D6B), LE16(0x0102), LE16(0x0100), 1, 2, 3, 1};

static uint8_t configuration[512];
static size_t configuration_bytes;

/* Adds a descriptor and returns where it lies; its first byte is its length. */
static uint8_t* add(const uint8_t* descriptor) {
  uint8_t* at = configuration + configuration_bytes;
  memcpy(at, descriptor, descriptor[0]);
  configuration_bytes += descriptor[0];
  return at;
}
#define ADD(...) add((const uint8_t[]){__VA_ARGS__})

static void add_frame(int subtype, int index, int width, int height) {
  int bytes = width * height * 2;
  ADD(30, 0x24, subtype, index, 0, LE16(width), LE16(height), LE32(bytes * 8 * FRAMES_PER_SECOND),
      LE32(bytes * 8 * FRAMES_PER_SECOND), LE32(bytes), LE32(FRAME_INTERVAL_100NS), 1, LE32(FRAME_INTERVAL_100NS));
}

/* Total lengths are filled in afterwards, for they count what follows. */
static void set_total(uint8_t* field, const uint8_t* first) {
  size_t total = (size_t)(configuration + configuration_bytes - first);
  field[0] = (uint8_t)total;
  field[1] = (uint8_t)(total >> 8);
}

static void make_configuration(void) {
  int formats = jpeg ? 2 : 1;
  uint8_t *whole, *control, *streaming;
  whole = ADD(9, 2, 0, 0, 2, 1, 0, 0x80, 250);       /* two interfaces, bus powered, 500 mA */
  ADD(8, 0x0B, CONTROL_INTERFACE, 2, 0x0E, 3, 0, 0); /* both are one video function */

  ADD(9, 4, CONTROL_INTERFACE, 0, 0, 0x0E, 1, 0, 0);
  control = ADD(13, 0x24, 1, LE16(0x0100), 0, 0, LE32(48000000), 1, STREAMING_INTERFACE);
  /* A lens (terminal 1) feeds a processing unit (2) with a brightness control, which feeds USB (terminal 3). */
  ADD(18, 0x24, 2, 1, LE16(0x0201), 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0);
  ADD(11, 0x24, 5, PROCESSING_UNIT, 1, 0, 0, 2, LE16(0x0001), 0);
  ADD(9, 0x24, 3, 3, LE16(0x0101), 0, PROCESSING_UNIT, 0);
  set_total(control + 5, control);

  ADD(9, 4, STREAMING_INTERFACE, 0, 1, 0x0E, 2, 0, 0);
  if (formats == 1) {
    streaming = ADD(14, 0x24, 1, 1, 0, 0, STREAM_ENDPOINT, 0, 3, 0, 0, 0, 1, 0);
  } else {
    streaming = ADD(15, 0x24, 1, 2, 0, 0, STREAM_ENDPOINT, 0, 3, 0, 0, 0, 1, 0, 0);
  }
  if (shows_depth) {
    ADD(27, 0x24, 4, FORMAT_YUYV, 2, 'I', 'N', 'V', 'Z', 0x90, 0x2D, 0x58, 0x4A, 0x92, 0x0B, 0x77, 0x3F, 0x1F, 0x2C,
        0x55, 0x6B, 16, 1, 0, 0, 0, 0);
  } else {
    ADD(27, 0x24, 4, FORMAT_YUYV, 2, 'Y', 'U', 'Y', '2', 0, 0, 0x10, 0, 0x80, 0, 0, 0xAA, 0, 0x38, 0x9B, 0x71, 16, 1, 0,
        0, 0, 0);
  }
  add_frame(5, 1, sizes[0].width, sizes[0].height);
  add_frame(5, 2, sizes[1].width, sizes[1].height);
  ADD(6, 0x24, 0x0D, 1, 1, 4); /* colours: BT.709 primaries and transfer, BT.601 matrix */
  if (formats == 2) {
    ADD(11, 0x24, 6, FORMAT_MJPEG, 1, 1, 1, 0, 0, 0, 0);
    add_frame(7, 1, sizes[0].width, sizes[0].height);
    ADD(6, 0x24, 0x0D, 1, 1, 4);
  }
  set_total(streaming + 4, streaming);

  ADD(7, 5, STREAM_ENDPOINT, 2, LE16(512), 0);
  set_total(whole + 2, whole);
}

static size_t string_descriptor(uint8_t* out, int index) {
  static const char* const strings[] = {"Maquette", "Virtual UVC Camera", "0001"};
  const char* text;
  size_t n = 2;
  if (index == 0) {
    memcpy(out, (const uint8_t[]){4, 3, LE16(0x0409)}, 4); /* the languages: English */
    return 4;
  }
  if (index > 3) return 0;
  for (text = strings[index - 1]; *text; ++text) {
    out[n++] = (uint8_t)*text;
    out[n++] = 0;
  }
  out[0] = (uint8_t)n;
  out[1] = 3;
  return n;
}

/* --------------------------------------------------------------------------------- USB/IP: transfers on a socket */

enum { SUBMIT = 1, UNLINK = 2, SUBMITTED = 3, UNLINKED = 4 };

struct message {
  uint32_t command, sequence, device, direction, endpoint; /* numbers are big-endian, unlike USB's own */
  union {
    struct {
      uint32_t flags, length, start_frame, packets, interval;
      uint8_t setup[8];
    } submit;
    struct {
      uint32_t status, length, start_frame, packets, errors;
      uint8_t padding[8];
    } answer;
    uint32_t unlink_sequence;
  } u;
};

static int host; /* our end of the socket pair */

/* The kernel closes the socket when the port is detached; nothing is left to serve then. */
static void write_all(const void* bytes, size_t n) {
  const char* at = bytes;
  while (n > 0) {
    ssize_t written = send(host, at, n, MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) exit(0);
    at += written;
    n -= (size_t)written;
  }
}

static void read_all(void* bytes, size_t n) {
  char* at = bytes;
  while (n > 0) {
    ssize_t got = read(host, at, n);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) exit(0);
    at += got;
    n -= (size_t)got;
  }
}

/* `sequence` is as it came. `data` follows only for transfers to the host. */
static void answer(uint32_t command, uint32_t sequence, int status, const void* data, size_t length, int to_host) {
  struct message m;
  memset(&m, 0, sizeof m);
  m.command = htonl(command);
  m.sequence = sequence;
  m.u.answer.status = htonl((uint32_t)status);
  m.u.answer.length = htonl((uint32_t)length);
  write_all(&m, sizeof m);
  if (to_host && length > 0) write_all(data, length);
}

/* ---------------------------------------------------------------------------------------------- control requests */

enum { SET_CUR = 0x01, GET_CUR = 0x81, GET_MIN, GET_MAX, GET_RES, GET_LEN, GET_INFO, GET_DEF };
enum { STALL = -1 };

static int16_t brightness = 128;

/* UVC 4.3.1.1: the host proposes a stream (probe) until both agree, then commits to it. */
static struct __attribute__((packed)) {
  uint16_t hint;
  uint8_t format, size;
  uint32_t interval;
  uint16_t key_frame_rate, p_frame_rate, quality, window_size, delay_ms;
  uint32_t frame_bytes, payload_bytes;
} stream = {1, FORMAT_YUYV, 1, FRAME_INTERVAL_100NS, 0, 0, 0, 0, 0, LARGEST_FRAME_BYTES, PAYLOAD_BYTES};

static int streaming_request(int request, int selector, const uint8_t* data, size_t length, uint8_t* out) {
  if (selector != 1 && selector != 2) return STALL; /* probe, commit */
  switch (request) {
    case SET_CUR:
      if (length < 4) return STALL;
      stream.format = data[2] == FORMAT_MJPEG && jpeg ? FORMAT_MJPEG : FORMAT_YUYV;
      stream.size = data[3] == 2 && stream.format == FORMAT_YUYV ? 2 : 1;
      stream.frame_bytes = (uint32_t)(sizes[stream.size - 1].width * sizes[stream.size - 1].height * 2);
      if (selector == 2) restart_stream(stream.format, stream.size - 1);
      return 0;
    case GET_LEN:
      out[0] = sizeof stream;
      out[1] = 0;
      return 2;
    case GET_INFO: out[0] = 3; return 1; /* can be read and set */
    default: memcpy(out, &stream, sizeof stream); return sizeof stream;
  }
}

static int brightness_request(int request, const uint8_t* data, size_t length, uint8_t* out) {
  int16_t value;
  switch (request) {
    case SET_CUR:
      if (length < 2) return STALL;
      memcpy(&brightness, data, 2);
      return 0;
    case GET_CUR: value = brightness; break;
    case GET_MIN: value = 0; break;
    case GET_MAX: value = 255; break;
    case GET_RES: value = 1; break;
    case GET_DEF: value = 128; break;
    case GET_LEN: value = 2; break;
    case GET_INFO: out[0] = 3; return 1;
    default: return STALL;
  }
  memcpy(out, &value, 2);
  return 2;
}

/* The bytes that go into `out` (0 for a request that only sets something), or STALL for what it does not know. */
static int control_request(const uint8_t setup[8], const uint8_t* data, size_t length, uint8_t* out) {
  int type = setup[0] & 0x60, to_host = setup[0] & 0x80, request = setup[1];
  int index = setup[4], entity = setup[5], low = setup[2], high = setup[3];
  if (type == 0x20) { /* of the video class */
    if (index == STREAMING_INTERFACE) return streaming_request(request, high, data, length, out);
    if (entity == PROCESSING_UNIT && high == 2) return brightness_request(request, data, length, out);
    if (entity == 0 && high == 2) { /* why the last request stalled: it was not known */
      out[0] = 6;
      return 1;
    }
    return STALL;
  }
  if (type != 0) return STALL;
  if (!to_host) return 0; /* set address, configuration, interface; clear halt: nothing has to change here */
  if (request == 6 && high == 1) {
    memcpy(out, device_descriptor, sizeof device_descriptor);
    return sizeof device_descriptor;
  }
  if (request == 6 && high == 2) {
    memcpy(out, configuration, configuration_bytes);
    return (int)configuration_bytes;
  }
  if (request == 6 && high == 3) {
    size_t n = string_descriptor(out, low);
    return n ? (int)n : STALL;
  }
  if (request == 0) { /* status: bus powered, not halted */
    out[0] = out[1] = 0;
    return 2;
  }
  return STALL;
}

/* ------------------------------------------------------------------------------------------------- the video stream */

/* Transfers the host has asked for and not yet got, first come first served. */
static struct { uint32_t sequence, length; } waiting[64];
static int waiting_count;

static void remove_waiting(int i) {
  --waiting_count;
  memmove(waiting + i, waiting + i + 1, sizeof *waiting * (size_t)(waiting_count - i));
}

static void send_frames(void) {
  static uint8_t payload[PAYLOAD_BYTES];
  while (waiting_count > 0) {
    uint32_t sequence = waiting[0].sequence;
    size_t room = waiting[0].length < PAYLOAD_BYTES ? waiting[0].length : PAYLOAD_BYTES, n;
    if (frame.sent == 0) {
      int64_t now = now_ns();
      if (now < frame.due_ns) return;
      /* After a pause of the host the stream goes on from now, instead of hurrying to catch up. */
      if (now - frame.due_ns > 1000000000) frame.due_ns = now;
      frame.due_ns += 1000000000 / FRAMES_PER_SECOND;
      draw_frame();
    }
    n = frame.length - frame.sent;
    if (n > room - PAYLOAD_HEADER_BYTES) n = room - PAYLOAD_HEADER_BYTES;
    memcpy(payload + PAYLOAD_HEADER_BYTES, frame.bytes + frame.sent, n);
    frame.sent += n;
    /* UVC 2.4.3.3: end of header, end of frame, and a bit that changes with each frame. */
    payload[0] = PAYLOAD_HEADER_BYTES;
    payload[1] = (uint8_t)(0x80 | (frame.sent == frame.length ? 2 : 0) | (frame.number & 1));
    if (frame.sent == frame.length) {
      frame.sent = 0;
      ++frame.number;
    }
    remove_waiting(0);
    answer(SUBMITTED, sequence, 0, payload, n + PAYLOAD_HEADER_BYTES, 1);
  }
}

static void handle_message(void) {
  struct message m;
  uint8_t data[4096], out[512];
  size_t length;
  int to_host, i, status = 0;
  read_all(&m, sizeof m);
  if (ntohl(m.command) == UNLINK) { /* the host gives up a transfer: -ECONNRESET says that it was still waiting */
    for (i = 0; i < waiting_count; ++i) {
      if (waiting[i].sequence != m.u.unlink_sequence) continue;
      remove_waiting(i);
      status = -ECONNRESET;
      break;
    }
    answer(UNLINKED, m.sequence, status, NULL, 0, 0);
    return;
  }
  length = ntohl(m.u.submit.length);
  to_host = ntohl(m.direction) == 1;
  if (!to_host) {
    if (length > sizeof data) exit(1);
    read_all(data, length);
  }
  if (ntohl(m.endpoint) == 0) {
    int n = control_request(m.u.submit.setup, data, length, out);
    if (n == STALL) {
      answer(SUBMITTED, m.sequence, -EPIPE, NULL, 0, 0);
    } else {
      if (to_host && (size_t)n < length) length = (size_t)n;
      answer(SUBMITTED, m.sequence, 0, out, length, to_host);
    }
  } else if (waiting_count < (int)(sizeof waiting / sizeof *waiting) && length > PAYLOAD_HEADER_BYTES) {
    waiting[waiting_count].sequence = m.sequence;
    waiting[waiting_count++].length = (uint32_t)length;
  } else {
    answer(SUBMITTED, m.sequence, -EPIPE, NULL, 0, 0);
  }
}

/* ---------------------------------------------------------------------------------------------------------- plug in */

static const char attach_path[] = "/sys/devices/platform/vhci_hcd.0/attach";

static void plug_in(int port) {
  enum { HIGH_SPEED = 3, TRIES = 50 };
  char request[64];
  int ends[2], file, try, length;
  if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) {
    perror("virtual_uvc_camera: socketpair");
    exit(1);
  }
  length = snprintf(request, sizeof request, "%d %d %d %d", port, ends[1], (1 << 16) | (port + 2), HIGH_SPEED);
  /* A port is busy for a moment after its last camera was unplugged. */
  for (try = 0;; ++try) {
    file = open(attach_path, O_WRONLY | O_CLOEXEC);
    if (file >= 0 && write(file, request, (size_t)length) == length) break;
    if (file < 0 || errno != EBUSY || try == TRIES) {
      fprintf(stderr, "virtual_uvc_camera: port %d of %s: %s (is the module vhci-hcd loaded?)\n", port, attach_path,
              strerror(errno));
      exit(1);
    }
    close(file);
    usleep(100000);
  }
  close(file);
  close(ends[1]);
  host = ends[0];
}

static uint8_t* read_file(const char* path, size_t largest, size_t* bytes) {
  uint8_t* content = malloc(largest + 1);
  FILE* file = fopen(path, "rb");
  if (!file || !content) {
    fprintf(stderr, "virtual_uvc_camera: %s cannot be read: %s\n", path, strerror(errno));
    exit(1);
  }
  *bytes = fread(content, 1, largest + 1, file);
  fclose(file);
  return content;
}

int main(int count, char** arguments) {
  static const struct option options[] = {
      {"port", required_argument, NULL, 'p'},    {"seconds", required_argument, NULL, 's'},
      {"picture", required_argument, NULL, 'y'}, {"jpeg", required_argument, NULL, 'j'},
      {"depth", no_argument, NULL, 'd'},         {NULL, 0, NULL, 0}};
  int64_t end_ns = INT64_MAX;
  size_t bytes;
  int port = 0, option;
  while ((option = getopt_long(count, arguments, "", options, NULL)) != -1) {
    switch (option) {
      case 'p': port = atoi(optarg); break;
      case 's': end_ns = now_ns() + (int64_t)(atof(optarg) * 1e9); break;
      case 'y':
        picture = read_file(optarg, LARGEST_FRAME_BYTES, &bytes);
        if (bytes != LARGEST_FRAME_BYTES) {
          fprintf(stderr, "virtual_uvc_camera: %s is no YUYV picture of %dx%d, which has %d bytes.\n", optarg,
                  LARGEST_WIDTH, LARGEST_HEIGHT, LARGEST_FRAME_BYTES);
          return 1;
        }
        break;
      case 'j':
        jpeg = read_file(optarg, LARGEST_FRAME_BYTES, &jpeg_bytes);
        if (jpeg_bytes == 0 || jpeg_bytes > LARGEST_FRAME_BYTES) {
          fprintf(stderr, "virtual_uvc_camera: %s must have 1 to %d bytes.\n", optarg, LARGEST_FRAME_BYTES);
          return 1;
        }
        break;
      case 'd': shows_depth = 1; break;
      default:
        fprintf(stderr,
                "usage: virtual_uvc_camera [--port N] [--seconds N] [--picture FILE] [--jpeg FILE] [--depth]\n");
        return 2;
    }
  }
  make_configuration();
  plug_in(port);
  for (;;) {
    struct pollfd readable = {host, POLLIN, 0};
    int64_t now = now_ns(), wait_ms = 50;
    if (now >= end_ns) return 0;
    if (waiting_count > 0) wait_ms = frame.due_ns <= now ? 0 : (frame.due_ns - now) / 1000000 + 1;
    poll(&readable, 1, wait_ms < 50 ? (int)wait_ms : 50);
    if (readable.revents & POLLIN) {
      handle_message();
    } else if (readable.revents & (POLLHUP | POLLERR)) {
      return 0;
    }
    send_frames();
  }
}
