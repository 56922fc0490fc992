// Rendered images of heads and scenes.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::object;
using maq_jni::sized;

MAQ_NATIVE_OF(NativeImage, void, release)(JNIEnv*, jclass, jlong image) { maq_image_release(object<maq_image>(image)); }

MAQ_NATIVE_OF(NativeImage, jintArray, size)(JNIEnv* env, jclass, jlong image) {
  return call(env, [&] {
    int32_t size_px[2];
    check(maq_image_get_size(object<maq_image>(image), &size_px[0], &size_px[1]));
    jintArray sides = env->NewIntArray(2);
    maq_jni::check_pending(env);
    env->SetIntArrayRegion(sides, 0, 2, size_px);
    return sides;
  });
}

// A plane as a direct buffer over the image's own memory; rows of `row_bytes` follow each other without padding.
MAQ_NATIVE_OF(NativeImage, jobject, plane)
(JNIEnv* env, jclass, jlong image, jint plane, jint row_bytes, jint height_px) {
  return call(env, [&]() -> jobject {
    const void* pixels = nullptr;
    size_t stride = 0;
    check(maq_image_get_plane(object<maq_image>(image), maq_image_plane(plane), &pixels, &stride));
    if (stride != size_t(row_bytes)) throw maq_jni::StatusError{MAQ_ERROR_INTERNAL, "rows of a plane have padding"};
    // Java gets it read-only (Kotlin: asReadOnlyBuffer).
    return env->NewDirectByteBuffer(const_cast<void*>(pixels), jlong(stride) * height_px);
  });
}

// In the order of maq_scene_render_stats.
MAQ_NATIVE_OF(NativeImage, jdoubleArray, sceneStats)(JNIEnv* env, jclass, jlong image) {
  return call(env, [&] {
    auto s = sized<maq_scene_render_stats>();
    check(maq_image_get_scene_stats(object<maq_image>(image), &s));
    return maq_jni::doubles_of(
        env, {s.project_ms, s.shade_ms, s.refine_ms, s.resample_ms, s.total_ms, double(s.drawn_block_count),
              double(s.drawn_point_count), double(s.shaded_point_count), double(s.refined_pixel_count)});
  });
}

MAQ_NATIVE_OF(NativeImage, void, save)(JNIEnv* env, jclass, jlong image, jbyteArray path, jint alpha) {
  call(env, [&] {
    check(maq_image_save(object<maq_image>(image), maq_jni::text(env, path).c_str(), maq_image_alpha(alpha)));
  });
}
