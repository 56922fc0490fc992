// Scenes and their renderers.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;

MAQ_NATIVE_OF(NativeScene, jlong, open)(JNIEnv* env, jclass, jlong context, jbyteArray path) {
  return call(env, [&] {
    maq_scene* scene = nullptr;
    check(maq_scene_open(object<maq_context>(context), maq_jni::text(env, path).c_str(), &scene));
    return handle(scene);
  });
}

MAQ_NATIVE_OF(NativeScene, jlong, openMemory)(JNIEnv* env, jclass, jlong context, jobject buffer) {
  return call(env, [&] {
    const maq_jni::Memory memory = maq_jni::memory_of(env, buffer);
    maq_scene* scene = nullptr;
    check(maq_scene_open_memory(object<maq_context>(context), memory.data, memory.size_bytes, &scene));
    return handle(scene);
  });
}

MAQ_NATIVE_OF(NativeScene, void, close)(JNIEnv*, jclass, jlong scene) { maq_scene_destroy(object<maq_scene>(scene)); }

MAQ_NATIVE_OF(NativeScene, void, save)(JNIEnv* env, jclass, jlong scene, jbyteArray path) {
  call(env, [&] { check(maq_scene_save(object<maq_scene>(scene), maq_jni::text(env, path).c_str())); });
}

MAQ_NATIVE_OF(NativeScene, void, savePly)(JNIEnv* env, jclass, jlong scene, jbyteArray path) {
  call(env, [&] { check(maq_scene_save_ply(object<maq_scene>(scene), maq_jni::text(env, path).c_str())); });
}

// Writes the SHA-256 of the networks to `networks`; returns counts, the up vector and the bounds.
MAQ_NATIVE_OF(NativeScene, jdoubleArray, info)(JNIEnv* env, jclass, jlong scene, jbyteArray networks) {
  return call(env, [&] {
    maq_scene_info info{};
    info.struct_size = sizeof info;
    check(maq_scene_get_info(object<maq_scene>(scene), &info));
    env->SetByteArrayRegion(networks, 0, 32, reinterpret_cast<const jbyte*>(info.networks_sha256));
    std::vector<jdouble> values = {double(info.coefficient_bits), double(info.point_count),
                                   double(info.view_dependent_count), double(info.block_count)};
    for (const double* vector : {info.up, info.bounds_min, info.bounds_max}) {
      values.insert(values.end(), vector, vector + 3);
    }
    return maq_jni::doubles_of(env, values);
  });
}

// `values` as in SceneRenderer.Config.
MAQ_NATIVE_OF(NativeScene, jlong, createRenderer)
(JNIEnv* env, jclass, jlong context, jlong scene, jbyteArray folder, jobjectArray names, jobjectArray buffers,
 jdoubleArray values) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 8);
    maq_scene_renderer_config config;
    check(maq_scene_renderer_config_init(&config, sizeof config));
    bundle.put_into(config.model);
    config.model.threads = int32_t(from[0]);
    config.use_background = int32_t(from[1]);
    for (size_t i = 0; i < 3; ++i) config.background[i] = uint8_t(from[2 + i]);
    config.near_depth = from[5];
    config.image_pool_size = maq_jni::count_of(from[6]);
    config.model.spinning = from[7] != 0 ? MAQ_SPINNING_ON : MAQ_SPINNING_OFF;
    maq_scene_renderer* renderer = nullptr;
    check(maq_scene_renderer_create(object<maq_context>(context), &config, object<maq_scene>(scene), &renderer));
    return handle(renderer);
  });
}

MAQ_NATIVE_OF(NativeScene, void, destroyRenderer)(JNIEnv*, jclass, jlong renderer) {
  maq_scene_renderer_destroy(object<maq_scene_renderer>(renderer));
}

MAQ_NATIVE_OF(NativeScene, jlong, render)(JNIEnv* env, jclass, jlong renderer, jdoubleArray camera) {
  return call(env, [&] {
    const maq_pinhole_camera from = maq_jni::pinhole_camera(env, camera);
    maq_image* image = nullptr;
    check(maq_scene_renderer_run(object<maq_scene_renderer>(renderer), &from, &image));
    return handle(image);
  });
}
