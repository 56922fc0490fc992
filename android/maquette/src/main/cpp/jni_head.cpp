// Heads: files, landmarks, cameras, and meshes.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::check_pending;
using maq_jni::handle;
using maq_jni::object;
using maq_jni::sized;

namespace {

// A copy as a direct buffer, which Java frees. `data` may be NULL.
jobject direct_copy_of(JNIEnv* env, const void* data, size_t size_bytes) {
  if (data == nullptr) return nullptr;
  jclass type = env->FindClass("java/nio/ByteBuffer");
  check_pending(env);
  jmethodID allocate = env->GetStaticMethodID(type, "allocateDirect", "(I)Ljava/nio/ByteBuffer;");
  check_pending(env);
  jobject buffer = env->CallStaticObjectMethod(type, allocate, jint(size_bytes));
  check_pending(env);
  std::memcpy(maq_jni::memory_of(env, buffer).data, data, size_bytes);
  env->DeleteLocalRef(type);
  return buffer;
}

jobjectArray object_array(JNIEnv* env, size_t size) {
  jclass type = env->FindClass("java/lang/Object");
  check_pending(env);
  jobjectArray array = env->NewObjectArray(jsize(size), type, nullptr);
  check_pending(env);
  env->DeleteLocalRef(type);
  return array;
}

// Takes over the reference to `element`: there may be few at a time.
void put(JNIEnv* env, jobjectArray array, size_t index, jobject element) {
  env->SetObjectArrayElement(array, jsize(index), element);
  env->DeleteLocalRef(element);
}

jbyteArray file_of(JNIEnv* env, const uint8_t* data, size_t size_bytes) {
  if (data == nullptr) return nullptr;
  jbyteArray array = env->NewByteArray(jsize(size_bytes));
  check_pending(env);
  env->SetByteArrayRegion(array, 0, jsize(size_bytes), reinterpret_cast<const jbyte*>(data));
  return array;
}

// Its name, vertices and deltas.
jobjectArray morph_target_of(JNIEnv* env, const maq_head_mesh* mesh, uint32_t index) {
  auto target = sized<maq_head_morph_target>();
  check(maq_head_mesh_get_morph_target(mesh, index, &target));
  jobjectArray parts = object_array(env, 3);
  put(env, parts, 0, maq_jni::bytes_of(env, target.name));
  jintArray vertices = env->NewIntArray(jsize(target.vertex_count));
  check_pending(env);
  env->SetIntArrayRegion(vertices, 0, jsize(target.vertex_count), reinterpret_cast<const jint*>(target.vertices));
  put(env, parts, 1, vertices);
  put(env, parts, 2, maq_jni::floats_of(env, target.deltas_m, size_t(3) * target.vertex_count));
  return parts;
}

jobjectArray morph_targets_of(JNIEnv* env, const maq_head_mesh* mesh, uint32_t count) {
  jobjectArray targets = object_array(env, count);
  for (uint32_t i = 0; i < count; ++i) put(env, targets, i, morph_target_of(env, mesh, i));
  return targets;
}

}  // namespace

MAQ_NATIVE_OF(NativeHead, jlong, open)(JNIEnv* env, jclass, jlong context, jbyteArray path) {
  return call(env, [&] {
    maq_head* head = nullptr;
    check(maq_head_open(object<maq_context>(context), maq_jni::text(env, path).c_str(), &head));
    return handle(head);
  });
}

MAQ_NATIVE_OF(NativeHead, jlong, openMemory)(JNIEnv* env, jclass, jlong context, jobject buffer) {
  return call(env, [&] {
    const maq_jni::Memory memory = maq_jni::memory_of(env, buffer);
    maq_head* head = nullptr;
    check(maq_head_open_memory(object<maq_context>(context), memory.data, memory.size_bytes, &head));
    return handle(head);
  });
}

MAQ_NATIVE_OF(NativeHead, jlong, scaleByDistance)
(JNIEnv* env, jclass, jlong head, jbyteArray from, jbyteArray to, jdouble distance_m) {
  return call(env, [&] {
    maq_head* scaled = nullptr;
    check(maq_head_scale_by_distance(object<maq_head>(head), maq_jni::text(env, from).c_str(),
                                     maq_jni::text(env, to).c_str(), distance_m, &scaled));
    return handle(scaled);
  });
}

MAQ_NATIVE_OF(NativeHead, jlong, scaleByDepth)(JNIEnv* env, jclass, jlong head, jint camera, jlong frame) {
  return call(env, [&] {
    maq_head* scaled = nullptr;
    check(maq_head_scale_by_depth(object<maq_head>(head), uint32_t(camera), object<maq_frame>(frame), &scaled));
    return handle(scaled);
  });
}

MAQ_NATIVE_OF(NativeHead, void, destroy)(JNIEnv*, jclass, jlong head) { maq_head_destroy(object<maq_head>(head)); }

MAQ_NATIVE_OF(NativeHead, void, save)(JNIEnv* env, jclass, jlong head, jbyteArray path) {
  call(env, [&] { check(maq_head_save(object<maq_head>(head), maq_jni::text(env, path).c_str())); });
}

// In the order of maq_head_info.
MAQ_NATIVE_OF(NativeHead, jdoubleArray, info)(JNIEnv* env, jclass, jlong head) {
  return call(env, [&] {
    auto info = sized<maq_head_info>();
    check(maq_head_get_info(object<maq_head>(head), &info));
    return maq_jni::doubles_of(env, {double(info.photo_count), double(info.landmark_count), double(info.scale),
                                     info.scale_sigma, double(info.texture_px)});
  });
}

MAQ_NATIVE_OF(NativeHead, jbyteArray, landmarkName)(JNIEnv* env, jclass, jlong head, jint index) {
  return call(env, [&] {
    const char* const name = maq_head_get_landmark_name(object<maq_head>(head), uint32_t(index));
    if (name == nullptr) maq_jni::refuse("The head has no landmark of this index.");
    return maq_jni::bytes_of(env, name);
  });
}

// x, y, z, then sigma.
MAQ_NATIVE_OF(NativeHead, jdoubleArray, landmark)(JNIEnv* env, jclass, jlong head, jbyteArray name) {
  return call(env, [&] {
    auto landmark = sized<maq_head_landmark>();
    check(maq_head_get_landmark(object<maq_head>(head), maq_jni::text(env, name).c_str(), &landmark));
    return maq_jni::doubles_of(env, {landmark.point_m[0], landmark.point_m[1], landmark.point_m[2], landmark.sigma_m});
  });
}

MAQ_NATIVE_OF(NativeHead, jdoubleArray, camera)(JNIEnv* env, jclass, jlong head, jint index) {
  return call(env, [&] {
    auto camera = sized<maq_pinhole_camera>();
    check(maq_head_get_camera(object<maq_head>(head), uint32_t(index), &camera));
    return maq_jni::doubles_of(env, maq_jni::values_of(camera));
  });
}

// `values` as in HeadMesh.Config.
MAQ_NATIVE_OF(NativeHead, jlong, createMesh)
(JNIEnv* env, jclass, jlong head, jdoubleArray values, jbyteArray folder, jobjectArray names, jobjectArray buffers) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const std::vector<jdouble> from = maq_jni::numbers(env, values, 3);
    maq_head_mesh_config config;
    check(maq_head_mesh_config_init(&config, sizeof config));
    bundle.put_into(config.model);
    config.triangle_count = maq_jni::count_of(from[0]);  // -1 is MAQ_HEAD_ALL_TRIANGLES
    config.cell_m = from[1];
    config.topology = maq_head_topology(int32_t(from[2]));
    maq_head_mesh* mesh = nullptr;
    check(maq_head_mesh_create(object<maq_head>(head), &config, &mesh));
    return handle(mesh);
  });
}

MAQ_NATIVE_OF(NativeHead, void, destroyMesh)(JNIEnv*, jclass, jlong mesh) {
  maq_head_mesh_destroy(object<maq_head_mesh>(mesh));
}

MAQ_NATIVE_OF(NativeHead, void, saveMesh)(JNIEnv* env, jclass, jlong mesh, jbyteArray path) {
  call(env, [&] { check(maq_head_mesh_save(object<maq_head_mesh>(mesh), maq_jni::text(env, path).c_str())); });
}

// Positions, normals, colours, template points, triangles, texture coordinates, texture, morph targets. Writes the
// simplification error.
MAQ_NATIVE_OF(NativeHead, jobjectArray, meshArrays)(JNIEnv* env, jclass, jlong mesh, jfloatArray error_m) {
  return call(env, [&] {
    const auto* const of = object<maq_head_mesh>(mesh);
    auto data = sized<maq_head_mesh_data>();
    check(maq_head_mesh_get_data(of, &data));
    env->SetFloatArrayRegion(error_m, 0, 1, &data.simplification_error_m);
    const auto of_vertices = [&](const void* values, size_t bytes) {
      return direct_copy_of(env, values, bytes * data.vertex_count);
    };
    constexpr size_t kPointBytes = 3 * sizeof(float);
    jobjectArray arrays = object_array(env, 8);
    put(env, arrays, 0, of_vertices(data.positions_m, kPointBytes));
    put(env, arrays, 1, of_vertices(data.normals, kPointBytes));
    put(env, arrays, 2, of_vertices(data.colours_rgb, 3));
    put(env, arrays, 3, of_vertices(data.template_points_m, kPointBytes));
    put(env, arrays, 4, direct_copy_of(env, data.triangles, 3 * sizeof(uint32_t) * data.triangle_count));
    put(env, arrays, 5, of_vertices(data.texture_coordinates, 2 * sizeof(float)));
    put(env, arrays, 6, file_of(env, data.texture_jpeg, data.texture_bytes));
    put(env, arrays, 7, morph_targets_of(env, of, data.morph_target_count));
    return arrays;
  });
}
