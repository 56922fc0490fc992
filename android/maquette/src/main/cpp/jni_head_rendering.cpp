// Images of heads.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;
using maq_jni::sized;

// `values` as in HeadRenderer.Config.
MAQ_NATIVE_OF(NativeHead, jlong, createRenderer)
(JNIEnv* env, jclass, jlong context, jlong mesh, jdoubleArray values) {
  return call(env, [&] {
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 10);
    maq_head_renderer_config config;
    check(maq_head_renderer_config_init(&config, sizeof config));
    config.threads = int32_t(from[0]);
    config.near_m = from[1];
    config.shading = maq_head_shading(int32_t(from[2]));
    config.shading_strength = float(from[3]);
    config.disable_antialiasing = int32_t(from[4]);
    config.use_background = int32_t(from[5]);
    for (size_t i = 0; i < 3; ++i) config.background[i] = uint8_t(from[6 + i]);
    config.image_pool_size = maq_jni::count_of(from[9]);
    maq_head_renderer* renderer = nullptr;
    check(maq_head_renderer_create(object<maq_context>(context), &config, object<maq_head_mesh>(mesh), &renderer));
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
    maq_image* image = nullptr;
    check(maq_head_renderer_run(object<maq_head_renderer>(renderer), &from, &image));
    return handle(image);
  });
}
