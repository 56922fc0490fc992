// Frames from images of Android's camera and decoders: YUV_420_888 with any strides becomes NV12.
#include <array>
#include <memory>

#include "jni_call.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::Memory;
using maq_jni::object;

namespace {

// Samples of one channel.
struct Channel {
  const uint8_t* data;
  int64_t row_stride, pixel_stride;
};

// Checks that `height` rows of `width` samples lie in the buffer: Java knows how long it is, and the last row may end
// with its last sample.
Channel channel_of(JNIEnv* env, jobject buffer, jint row_stride, jint pixel_stride, int64_t width, int64_t height) {
  const Memory memory = maq_jni::memory_of(env, buffer);
  if (pixel_stride < 1) maq_jni::refuse("The pixel stride of a plane is less than 1.");
  const int64_t row = (width - 1) * pixel_stride + 1;
  if (row_stride < 0 || (height > 1 && row_stride < row)) {
    maq_jni::refuse("The row stride of a plane is shorter than its rows.");
  }
  const int64_t needed = (height - 1) * row_stride + row;
  if (uint64_t(needed) > memory.size_bytes) {
    throw maq_jni::StatusError{MAQ_ERROR_INVALID_ARGUMENT, "A plane needs " + std::to_string(needed) +
                                                               " bytes, but its buffer has " +
                                                               std::to_string(memory.size_bytes) + "."};
  }
  return {memory.data, row_stride, pixel_stride};
}

using Levels = std::array<uint8_t, 256>;

// BT.601: levels of the full range in the video range, where luma is 16 to 235 and chroma 16 to 240 about 128.
Levels video_levels(bool is_full_range, double from_middle, double to_middle, double scale) {
  Levels levels;
  for (size_t i = 0; i < levels.size(); ++i) {
    levels[i] = is_full_range ? uint8_t(to_middle + (double(i) - from_middle) * scale + 0.5) : uint8_t(i);
  }
  return levels;
}

void copy_row(const Channel& from, int64_t row, const Levels& levels, int64_t width, uint8_t* to, int64_t to_stride) {
  const uint8_t* sample = from.data + row * from.row_stride;
  for (int64_t x = 0; x < width; ++x) to[x * to_stride] = levels[sample[x * from.pixel_stride]];
}

void free_pixels(void* pixels) { delete[] static_cast<uint8_t*>(pixels); }

}  // namespace

MAQ_NATIVE(jlong, frameOfImage)
(JNIEnv* env, jclass, jlong context, jint width_px, jint height_px, jobjectArray buffers, jintArray strides,
 jboolean is_full_range, jlong timestamp_ns, jint clock, jlong sequence) {
  return call(env, [&] {
    if (width_px < 1 || height_px < 1 || width_px > MAQ_MAX_SIDE_PX || height_px > MAQ_MAX_SIDE_PX ||
        int64_t(width_px) * height_px > MAQ_MAX_PIXELS) {
      throw maq_jni::StatusError{MAQ_ERROR_IMAGE_SIZE, "An image has " + std::to_string(width_px) + " x " +
                                                           std::to_string(height_px) +
                                                           " pixels, which is none or too many."};
    }
    std::array<jint, 6> stride;  // row stride and pixel stride of Y, U and V
    env->GetIntArrayRegion(strides, 0, 6, stride.data());
    const int64_t width = width_px, height = height_px, half_width = (width + 1) / 2, half_height = (height + 1) / 2;
    std::array<Channel, 3> yuv;
    for (size_t i = 0; i < yuv.size(); ++i) {
      jobject buffer = env->GetObjectArrayElement(buffers, jsize(i));
      maq_jni::check_pending(env);
      yuv[i] = channel_of(env, buffer, stride[2 * i], stride[2 * i + 1], i == 0 ? width : half_width,
                          i == 0 ? height : half_height);
      env->DeleteLocalRef(buffer);
    }
    const Levels luma = video_levels(is_full_range, 0, 16, 219.0 / 255);
    const Levels chroma = video_levels(is_full_range, 128, 128, 224.0 / 255);
    auto pixels = std::make_unique<uint8_t[]>(size_t(width * height + 2 * half_width * half_height));
    uint8_t* const uv = pixels.get() + width * height;
    for (int64_t row = 0; row < height; ++row) {
      copy_row(yuv[0], row, luma, width, pixels.get() + row * width, 1);
      if (row % 2 != 0) continue;
      uint8_t* const uv_row = uv + row * half_width;  // row / 2 rows of 2 * half_width bytes
      copy_row(yuv[1], row / 2, chroma, half_width, uv_row, 2);
      copy_row(yuv[2], row / 2, chroma, half_width, uv_row + 1, 2);
    }
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc));
    desc.format = MAQ_PIXEL_NV12;
    desc.width_px = width_px;
    desc.height_px = height_px;
    desc.planes[0] = pixels.get();
    desc.planes[1] = uv;
    desc.timestamp_ns = timestamp_ns;
    desc.clock = maq_clock(clock);
    desc.sequence = uint64_t(sequence);
    maq_frame* frame = nullptr;
    check(maq_frame_wrap(object<maq_context>(context), &desc, free_pixels, pixels.get(), &frame));
    pixels.release();
    return handle(frame);
  });
}
