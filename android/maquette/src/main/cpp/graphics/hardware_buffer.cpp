#include "graphics/hardware_buffer.h"

#include <cerrno>
#include <memory>
#include <string>

#include "status_error.h"

namespace maq_jni {
namespace {

std::string text_of(const AHardwareBuffer_Desc& desc) {
  return "The hardware buffer of " + std::to_string(desc.width) + " x " + std::to_string(desc.height) + " pixels ";
}

// A buffer that is kept and locked; the end of it is the end of both.
class LockedBuffer {
 public:
  LockedBuffer(const GraphicsFunctions& android, AHardwareBuffer* buffer) : android_(android), buffer_(buffer) {
    android_.AHardwareBuffer_acquire(buffer_);
    android_.AHardwareBuffer_describe(buffer_, &desc_);
  }
  ~LockedBuffer() {
    if (is_locked_) android_.AHardwareBuffer_unlock(buffer_, nullptr);
    android_.AHardwareBuffer_release(buffer_);
  }
  LockedBuffer(const LockedBuffer&) = delete;
  LockedBuffer& operator=(const LockedBuffer&) = delete;

  const AHardwareBuffer_Desc& desc() const { return desc_; }

  // Locks for the usages of `mask` that the buffer is made for; `verb` and `remedy` are for the sentence when there is
  // none.
  uint8_t* lock(uint64_t mask, int pixel_bytes, const char* verb, const char* remedy) {
    require_usage(mask, verb, remedy);
    if (desc_.stride < desc_.width || desc_.stride > uint32_t(INT32_MAX / pixel_bytes)) {
      throw StatusError{MAQ_ERROR_UNREADABLE, text_of(desc_) + "has rows of " + std::to_string(desc_.stride) +
                                                  " pixels by Android, which cannot be."};
    }
    void* pixels = nullptr;
    const int error = android_.AHardwareBuffer_lock(buffer_, desc_.usage & mask, -1, nullptr, &pixels);
    require_locked(error, pixels != nullptr);
    return static_cast<uint8_t*>(pixels);
  }

  AHardwareBuffer_Planes lock_planes(const char* remedy) {
    require_usage(AHARDWAREBUFFER_USAGE_CPU_READ_MASK, "read", remedy);
    if (android_.AHardwareBuffer_lockPlanes == nullptr) {
      throw StatusError{MAQ_ERROR_UNSUPPORTED,
                        "YUV hardware buffers need Android 10 (API level 29); give the planes of the Image instead."};
    }
    AHardwareBuffer_Planes planes{};
    const uint64_t usage = desc_.usage & AHARDWAREBUFFER_USAGE_CPU_READ_MASK;
    require_locked(android_.AHardwareBuffer_lockPlanes(buffer_, usage, -1, nullptr, &planes), true);
    return planes;
  }

 private:
  void require_usage(uint64_t mask, const char* verb, const char* remedy) const {
    if ((desc_.usage & AHARDWAREBUFFER_USAGE_PROTECTED_CONTENT) != 0) {
      throw StatusError{MAQ_ERROR_UNSUPPORTED,
                        text_of(desc_) + "has protected content, which no app may " + verb + "."};
    }
    if (desc_.layers != 1) {
      throw StatusError{MAQ_ERROR_UNSUPPORTED,
                        text_of(desc_) + "has " + std::to_string(desc_.layers) + " layers; only one can be used."};
    }
    if ((desc_.usage & mask) == 0) {
      refuse(text_of(desc_) + "is for the GPU alone, and the CPU may not " + verb + " it. Make it with " + remedy +
             ".");
    }
  }

  void require_locked(int error, bool has_pixels) {
    is_locked_ = error == 0;
    if (is_locked_ && has_pixels) return;
    if (error == -ENOMEM) throw StatusError{MAQ_ERROR_OUT_OF_MEMORY, "There is no memory to lock a hardware buffer."};
    throw StatusError{MAQ_ERROR_UNREADABLE, text_of(desc_) + "cannot be locked: error " + std::to_string(error) + "."};
  }

  const GraphicsFunctions& android_;
  AHardwareBuffer* buffer_;
  AHardwareBuffer_Desc desc_{};
  bool is_locked_ = false;
};

constexpr char kReadUsage[] = "HardwareBuffer.USAGE_CPU_READ_OFTEN";

// A frame in the buffer's memory, which is the frame's from then on.
maq_frame* wrapped(maq_context* context, const maq_frame_desc& desc, std::unique_ptr<LockedBuffer> locked) {
  maq_frame* frame = nullptr;
  check(maq_frame_wrap(
      context, &desc, [](void* kept) { delete static_cast<LockedBuffer*>(kept); }, locked.get(), &frame));
  (void)locked.release();  // the frame has it
  return frame;
}

maq_frame* frame_of_yuv(const AHardwareBuffer_Planes& planes, maq_context* context, const maq_frame_desc& like,
                        maq_yuv_image image, std::unique_ptr<LockedBuffer> locked) {
  if (planes.planeCount != 3) {
    throw StatusError{MAQ_ERROR_UNSUPPORTED, text_of(locked->desc()) + "has " + std::to_string(planes.planeCount) +
                                                 " planes; YUV of three planes can be used."};
  }
  image.width_px = like.width_px;
  image.height_px = like.height_px;
  for (int i = 0; i < 3; ++i) {
    const AHardwareBuffer_Plane& plane = planes.planes[i];
    if (plane.rowStride > uint32_t(INT32_MAX) || plane.pixelStride > uint32_t(INT32_MAX)) {
      throw StatusError{MAQ_ERROR_UNREADABLE, text_of(locked->desc()) + "has strides that cannot be."};
    }
    image.planes[i] = static_cast<const uint8_t*>(plane.data);
    image.stride_bytes[i] = int32_t(plane.rowStride);
    image.pixel_stride_bytes[i] = int32_t(plane.pixelStride);
    image.size_bytes[i] = SIZE_MAX;  // Android does not say it of a buffer
  }
  const AHardwareBuffer_Plane &u = planes.planes[1], &v = planes.planes[2];
  const bool is_nv12 = u.pixelStride == 2 && v.pixelStride == 2 && u.rowStride == v.rowStride &&
                       static_cast<uint8_t*>(v.data) == static_cast<uint8_t*>(u.data) + 1 &&
                       planes.planes[0].pixelStride == 1;
  if (is_nv12 && image.is_video_range == 1 && image.rotation_deg == 0) {
    maq_frame_desc desc = like;
    desc.format = MAQ_PIXEL_NV12;
    for (int i = 0; i < 2; ++i) {
      desc.planes[i] = image.planes[i];
      desc.stride_bytes[i] = planes.planes[i].rowStride;
    }
    return wrapped(context, desc, std::move(locked));
  }
  maq_frame* frame = nullptr;
  check(maq_frame_convert_yuv(context, &image, &frame));
  return frame;
}

}  // namespace

maq_frame* frame_of(const GraphicsFunctions& android, AHardwareBuffer* buffer, maq_context* context,
                    const maq_yuv_image& like) {
  auto locked = std::make_unique<LockedBuffer>(android, buffer);
  const AHardwareBuffer_Desc& of = locked->desc();
  const auto is_side = [](uint32_t pixels) { return pixels >= 1 && pixels <= uint32_t(MAQ_MAX_SIDE_PX); };
  if (!is_side(of.width) || !is_side(of.height)) {
    throw StatusError{MAQ_ERROR_IMAGE_SIZE,
                      text_of(of) + "is empty, or over the limit of " + std::to_string(MAQ_MAX_SIDE_PX) + " a side."};
  }
  maq_frame_desc desc;
  check(maq_frame_desc_init(&desc, sizeof desc));
  desc.width_px = int32_t(of.width);
  desc.height_px = int32_t(of.height);
  desc.timestamp_ns = like.timestamp_ns;
  desc.clock = like.clock;
  desc.sequence = like.sequence;
  int pixel_bytes = 0;
  switch (of.format) {
    case AHARDWAREBUFFER_FORMAT_R8G8B8A8_UNORM:
    case AHARDWAREBUFFER_FORMAT_R8G8B8X8_UNORM:
      desc.format = MAQ_PIXEL_RGBA8;
      pixel_bytes = 4;
      break;
    case AHARDWAREBUFFER_FORMAT_R8G8B8_UNORM:
      desc.format = MAQ_PIXEL_RGB8;
      pixel_bytes = 3;
      break;
    case AHARDWAREBUFFER_FORMAT_Y8Cb8Cr8_420: {
      const AHardwareBuffer_Planes planes = locked->lock_planes(kReadUsage);
      return frame_of_yuv(planes, context, desc, like, std::move(locked));
    }
    default:
      throw StatusError{MAQ_ERROR_UNSUPPORTED, text_of(of) + "has the format " + std::to_string(of.format) +
                                                   "; RGBA_8888, RGBX_8888, RGB_888 and YCBCR_420_888 can be used."};
  }
  if (like.rotation_deg != 0) refuse(text_of(of) + "is RGB, and only YUV can be rotated.");
  desc.planes[0] = locked->lock(AHARDWAREBUFFER_USAGE_CPU_READ_MASK, pixel_bytes, "read", kReadUsage);
  desc.stride_bytes[0] = size_t(of.stride) * size_t(pixel_bytes);
  return wrapped(context, desc, std::move(locked));
}

void draw_on(const GraphicsFunctions& android, AHardwareBuffer* buffer, void (*draw)(void* self, const Canvas&),
             void* self) {
  LockedBuffer locked(android, buffer);
  const AHardwareBuffer_Desc& of = locked.desc();
  if (of.format != AHARDWAREBUFFER_FORMAT_R8G8B8A8_UNORM && of.format != AHARDWAREBUFFER_FORMAT_R8G8B8X8_UNORM) {
    throw StatusError{MAQ_ERROR_UNSUPPORTED, text_of(of) + "has the format " + std::to_string(of.format) +
                                                 "; RGBA_8888 and RGBX_8888 can be drawn on."};
  }
  uint8_t* const rgba =
      locked.lock(AHARDWAREBUFFER_USAGE_CPU_WRITE_MASK, 4, "write", "HardwareBuffer.USAGE_CPU_WRITE_OFTEN");
  const size_t stride = size_t(of.stride) * 4;
  draw(self, {int(of.width), int(of.height), rgba, stride, stride * of.height});
}

}  // namespace maq_jni
