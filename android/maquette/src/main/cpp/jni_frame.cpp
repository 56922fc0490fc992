// Frames: decoded, or wrapped around direct buffers of the app.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "jni_config.h"
#include "jni_threads.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::Memory;
using maq_jni::object;

namespace {

// Buffers of the app that a frame lies in.
struct Held {
  std::array<jobject, 2> buffers{};

  void release(JNIEnv* env) {
    for (jobject buffer : buffers) {
      if (buffer != nullptr) env->DeleteGlobalRef(buffer);
    }
  }
};

// Called on the thread that released the frame last, which may be one of the library's own.
void release_buffers(void* user_data) {
  const std::unique_ptr<Held> held(static_cast<Held*>(user_data));
  const maq_jni::Attached attached;
  if (attached.env != nullptr) held->release(attached.env);
}

int64_t rows_of(maq_pixel_format format, size_t plane, int64_t height_px) {
  return format == MAQ_PIXEL_NV12 && plane == 1 ? (height_px + 1) / 2 : height_px;
}

int64_t row_bytes(maq_pixel_format format, size_t plane, int64_t width_px) {
  switch (format) {
    case MAQ_PIXEL_RGB8:
    case MAQ_PIXEL_BGR8: return 3 * width_px;
    case MAQ_PIXEL_RGBA8: return 4 * width_px;
    case MAQ_PIXEL_GREY8: return width_px;
    case MAQ_PIXEL_NV12: return plane == 0 ? width_px : 2 * ((width_px + 1) / 2);
    case MAQ_PIXEL_YUYV: return 4 * ((width_px + 1) / 2);
    case MAQ_PIXEL_DEPTH16: return 2 * width_px;
    case MAQ_PIXEL_DEPTH32F: return 4 * width_px;
  }
  maq_jni::refuse("unknown pixel format");
  return 0;
}

// The C API cannot see how long a buffer is; Java can.
void require_rows(const Memory& memory, int64_t rows, int64_t stride, int64_t row) {
  if (rows < 1) return;  // refused by maq_frame_wrap
  const int64_t needed = (rows - 1) * stride + row;
  if (stride < 0 || row < 0 || needed < 0 || uint64_t(needed) > memory.size_bytes) {
    throw maq_jni::StatusError{MAQ_ERROR_INVALID_ARGUMENT, "A plane needs " + std::to_string(needed) +
                                                               " bytes, but its buffer has " +
                                                               std::to_string(memory.size_bytes) + "."};
  }
}

}  // namespace

MAQ_NATIVE(jlong, wrapFrame)
(JNIEnv* env, jclass, jlong context, jint format, jint width_px, jint height_px, jobject first, jint first_stride,
 jobject second, jint second_stride, jlong timestamp_ns, jint clock, jlong sequence, jdoubleArray intrinsics) {
  return call(env, [&] {
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc));
    desc.format = maq_pixel_format(format);
    desc.width_px = width_px;
    desc.height_px = height_px;
    desc.timestamp_ns = timestamp_ns;
    desc.clock = maq_clock(clock);
    desc.sequence = uint64_t(sequence);
    if (intrinsics != nullptr) desc.intrinsics = maq_jni::intrinsics(env, intrinsics);
    const std::array<jobject, 2> buffers = {first, second};
    const std::array<jint, 2> strides = {first_stride, second_stride};
    auto held = std::make_unique<Held>();
    for (size_t plane = 0; plane < (desc.format == MAQ_PIXEL_NV12 ? 2u : 1u); ++plane) {
      const Memory memory = maq_jni::memory_of(env, buffers[plane]);
      const int64_t row = row_bytes(desc.format, plane, width_px);
      const int64_t stride = strides[plane] == 0 ? row : strides[plane];
      require_rows(memory, rows_of(desc.format, plane, height_px), stride, row);
      desc.planes[plane] = memory.data;
      desc.stride_bytes[plane] = size_t(stride);
    }
    std::transform(buffers.begin(), buffers.end(), held->buffers.begin(),
                   [&](jobject buffer) { return buffer == nullptr ? nullptr : env->NewGlobalRef(buffer); });
    maq_frame* frame = nullptr;
    const maq_status status = maq_frame_wrap(object<maq_context>(context), &desc, release_buffers, held.get(), &frame);
    if (status != MAQ_OK) held->release(env);
    check(status);
    static_cast<void>(held.release());  // the frame's
    return handle(frame);
  });
}

MAQ_NATIVE(jlong, decodeFrame)(JNIEnv* env, jclass, jlong context, jobject buffer, jint size_bytes) {
  return call(env, [&] {
    const Memory memory = maq_jni::memory_of(env, buffer);
    if (size_bytes < 0 || size_t(size_bytes) > memory.size_bytes) maq_jni::refuse("the size is not the buffer's");
    maq_frame* frame = nullptr;
    check(maq_frame_decode(object<maq_context>(context), memory.data, size_t(size_bytes), &frame));
    return handle(frame);
  });
}

MAQ_NATIVE(void, releaseFrame)(JNIEnv*, jclass, jlong frame) { maq_frame_release(object<maq_frame>(frame)); }

// Width, height, format, clock, timestamp, sequence.
MAQ_NATIVE(jlongArray, describeFrame)(JNIEnv* env, jclass, jlong frame) {
  return call(env, [&]() -> jlongArray {
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc));
    check(maq_frame_get_desc(object<maq_frame>(frame), &desc));
    const jlong values[] = {desc.width_px, desc.height_px,    desc.format,
                            desc.clock,    desc.timestamp_ns, jlong(desc.sequence)};
    jlongArray array = env->NewLongArray(6);
    maq_jni::check_pending(env);
    env->SetLongArrayRegion(array, 0, 6, values);
    return array;
  });
}

// Returns the intrinsics; null if they are unknown.
MAQ_NATIVE(jdoubleArray, intrinsicsOfFrame)(JNIEnv* env, jclass, jlong frame) {
  return call(env, [&]() -> jdoubleArray {
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc));
    check(maq_frame_get_desc(object<maq_frame>(frame), &desc));
    return desc.intrinsics.width_px == 0 ? nullptr : maq_jni::doubles_of(env, maq_jni::values_of(desc.intrinsics));
  });
}

// For a predicted frame: its horizon and age, and timestamp and sequence of the captured frame. Null for a captured
// frame.
MAQ_NATIVE(jlongArray, originOfFrame)(JNIEnv* env, jclass, jlong frame) {
  return call(env, [&]() -> jlongArray {
    auto origin = maq_jni::sized<maq_frame_origin>();
    check(maq_frame_get_origin(object<maq_frame>(frame), &origin));
    if (origin.kind == MAQ_FRAME_CAPTURED) return nullptr;
    const jlong values[] = {origin.horizon_ns, origin.age_ns, origin.captured_timestamp_ns,
                            jlong(origin.captured_sequence)};
    jlongArray array = env->NewLongArray(4);
    maq_jni::check_pending(env);
    env->SetLongArrayRegion(array, 0, 4, values);
    return array;
  });
}

MAQ_NATIVE(void, copyFramePixels)(JNIEnv* env, jclass, jlong frame, jint format, jobject buffer) {
  call(env, [&] {
    const Memory memory = maq_jni::memory_of(env, buffer);
    check(maq_frame_copy_pixels(object<maq_frame>(frame), maq_pixel_format(format), memory.data, 0, memory.size_bytes));
  });
}

// Metres, 0 where unknown; null of a frame without depth. Writes width and height to `size`.
MAQ_NATIVE(jfloatArray, depthOfFrame)(JNIEnv* env, jclass, jlong frame, jintArray size) {
  return call(env, [&]() -> jfloatArray {
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc));
    const maq_status status = maq_frame_get_depth(object<maq_frame>(frame), &desc);
    if (status == MAQ_ERROR_UNSUPPORTED) return nullptr;
    check(status);
    std::vector<jfloat> metres(size_t(desc.width_px) * size_t(desc.height_px));
    for (size_t y = 0; y < size_t(desc.height_px); ++y) {
      const uint8_t* const row = desc.planes[0] + y * desc.stride_bytes[0];
      jfloat* const to = &metres[y * size_t(desc.width_px)];
      if (desc.format == MAQ_PIXEL_DEPTH32F) {
        const auto* const from = reinterpret_cast<const float*>(row);
        std::transform(from, from + desc.width_px, to, [](float z) { return std::isfinite(z) && z > 0 ? z : 0.0f; });
      } else {
        const auto* const from = reinterpret_cast<const uint16_t*>(row);
        std::transform(from, from + desc.width_px, to, [](uint16_t z) { return z == 65535 ? 0.0f : z * 0.001f; });
      }
    }
    const jint sides[] = {desc.width_px, desc.height_px};
    env->SetIntArrayRegion(size, 0, 2, sides);
    return maq_jni::floats_of(env, metres.data(), metres.size());
  });
}

MAQ_NATIVE(void, saveFrame)(JNIEnv* env, jclass, jlong frame, jbyteArray path) {
  call(env, [&] { check(maq_frame_save(object<maq_frame>(frame), maq_jni::text(env, path).c_str())); });
}

MAQ_NATIVE(jlong, resizeFrame)(JNIEnv* env, jclass, jlong frame, jint width_px, jint height_px) {
  return call(env, [&] {
    maq_frame* resized = nullptr;
    check(maq_frame_resize(object<maq_frame>(frame), width_px, height_px, &resized));
    return handle(resized);
  });
}
