// Frames from images of Android's camera and decoders: YUV_420_888 with any strides becomes NV12.
#include <array>

#include "jni_call.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::Memory;
using maq_jni::object;

MAQ_NATIVE(jlong, frameOfImage)
(JNIEnv* env, jclass, jlong context, jint width_px, jint height_px, jobjectArray buffers, jintArray strides,
 jboolean is_full_range, jint rotation_deg, jlong timestamp_ns, jint clock, jlong sequence) {
  return call(env, [&] {
    maq_yuv_image image;
    check(maq_yuv_image_init(&image, sizeof image));
    image.width_px = width_px;
    image.height_px = height_px;
    std::array<jint, 6> stride;  // row stride and pixel stride of Y, U and V
    env->GetIntArrayRegion(strides, 0, 6, stride.data());
    for (int i = 0; i < 3; ++i) {
      jobject buffer = env->GetObjectArrayElement(buffers, i);
      maq_jni::check_pending(env);
      const Memory memory = maq_jni::memory_of(env, buffer);
      env->DeleteLocalRef(buffer);
      image.planes[i] = memory.data;
      image.size_bytes[i] = memory.size_bytes;
      image.stride_bytes[i] = stride[2 * size_t(i)];
      image.pixel_stride_bytes[i] = stride[2 * size_t(i) + 1];
    }
    image.is_video_range = is_full_range ? 0 : 1;
    image.rotation_deg = rotation_deg;
    image.timestamp_ns = timestamp_ns;
    image.clock = maq_clock(clock);
    image.sequence = uint64_t(sequence);
    maq_frame* frame = nullptr;
    check(maq_frame_convert_yuv(object<maq_context>(context), &image, &frame));
    return handle(frame);
  });
}
