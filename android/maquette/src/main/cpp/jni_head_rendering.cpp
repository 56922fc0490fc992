// Pictures of heads.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;
using maq_jni::sized;

// `values` as in HeadRenderer.Config.
MAQ_NATIVE_OF(NativeHead, jlong, createRenderer)
(JNIEnv* env, jclass, jlong context, jlong head, jdoubleArray values, jdoubleArray mesh_options, jbyteArray folder,
 jobjectArray names, jobjectArray buffers) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const maq_head_mesh_options mesh = maq_jni::head_mesh_options(env, bundle, mesh_options);
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 10);
    maq_head_renderer_config config;
    check(maq_head_renderer_config_init(&config, sizeof config));
    config.mesh = &mesh;
    config.threads = int32_t(from[0]);
    config.near_m = from[1];
    config.shading = maq_head_shading(int32_t(from[2]));
    config.light = float(from[3]);
    config.smooth_edges = int32_t(from[4]);
    config.use_background = int32_t(from[5]);
    for (size_t i = 0; i < 3; ++i) config.background[i] = uint8_t(from[6 + i]);
    config.image_pool_size = maq_jni::count_of(from[9]);
    maq_head_renderer* renderer = nullptr;
    check(maq_head_renderer_create(object<maq_context>(context), &config, object<maq_head>(head), &renderer));
    return handle(renderer);
  });
}

MAQ_NATIVE_OF(NativeHead, void, destroyRenderer)(JNIEnv*, jclass, jlong renderer) {
  maq_head_renderer_destroy(object<maq_head_renderer>(renderer));
}

MAQ_NATIVE_OF(NativeHead, jdoubleArray, orbitCamera)
(JNIEnv* env, jclass, jlong renderer, jdouble yaw_rad, jdouble pitch_rad, jint width_px, jint height_px) {
  return call(env, [&] {
    auto camera = sized<maq_pinhole_camera>();
    check(maq_head_renderer_get_camera(object<maq_head_renderer>(renderer), yaw_rad, pitch_rad, width_px, height_px,
                                       &camera));
    return maq_jni::doubles_of(env, maq_jni::values_of(camera));
  });
}

MAQ_NATIVE_OF(NativeHead, void, setShading)(JNIEnv* env, jclass, jlong renderer, jint shading) {
  call(env,
       [&] { check(maq_head_renderer_set_shading(object<maq_head_renderer>(renderer), maq_head_shading(shading))); });
}

MAQ_NATIVE_OF(NativeHead, jlong, render)(JNIEnv* env, jclass, jlong renderer, jdoubleArray camera) {
  return call(env, [&] {
    const maq_pinhole_camera from = maq_jni::pinhole_camera(env, camera);
    maq_head_image* image = nullptr;
    check(maq_head_renderer_run(object<maq_head_renderer>(renderer), &from, &image));
    return handle(image);
  });
}

MAQ_NATIVE_OF(NativeHead, void, releaseImage)(JNIEnv*, jclass, jlong image) {
  maq_head_image_release(object<maq_head_image>(image));
}

// A plane as a direct buffer over the image's own memory; rows of `row_bytes` follow each other without padding.
MAQ_NATIVE_OF(NativeHead, jobject, planeOfImage)
(JNIEnv* env, jclass, jlong image, jint plane, jint row_bytes, jint height_px) {
  return call(env, [&]() -> jobject {
    const void* pixels = nullptr;
    size_t stride = 0;
    check(maq_head_image_get_plane(object<maq_head_image>(image), maq_head_plane(plane), &pixels, &stride));
    if (stride != size_t(row_bytes)) throw maq_jni::StatusError{MAQ_ERROR_INTERNAL, "rows of a plane have padding"};
    // Java gets it read-only (Kotlin: asReadOnlyBuffer).
    return env->NewDirectByteBuffer(const_cast<void*>(pixels), jlong(stride) * height_px);
  });
}

MAQ_NATIVE_OF(NativeHead, void, saveImage)(JNIEnv* env, jclass, jlong image, jbyteArray path, jboolean with_alpha) {
  call(env, [&] {
    check(maq_head_image_save(object<maq_head_image>(image), maq_jni::text(env, path).c_str(), with_alpha));
  });
}
