// Dense pose: networks, runs and results.
#include <vector>

#include "jni_call.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::Memory;
using maq_jni::object;

namespace {

// The files of a bundle in direct buffers.
struct BundleFiles {
  std::vector<std::string> names;
  std::vector<maq_memory_file> files;

  BundleFiles(JNIEnv* env, jobjectArray utf8_names, jobjectArray buffers) {
    if (utf8_names == nullptr || buffers == nullptr) return;
    const jsize count = env->GetArrayLength(utf8_names);
    if (env->GetArrayLength(buffers) != count) maq_jni::refuse("a bundle needs a name for each buffer");
    names.reserve(size_t(count));  // `files` points into them
    for (jsize i = 0; i < count; ++i) {
      const auto name = static_cast<jbyteArray>(env->GetObjectArrayElement(utf8_names, i));
      jobject buffer = env->GetObjectArrayElement(buffers, i);
      maq_jni::check_pending(env);
      names.push_back(maq_jni::text(env, name));
      const Memory memory = maq_jni::memory_of(env, buffer);
      files.push_back({names.back().c_str(), memory.data, memory.size_bytes});
      env->DeleteLocalRef(name);
      env->DeleteLocalRef(buffer);
    }
  }
};

}  // namespace

MAQ_NATIVE(jlong, createDensePose)
(JNIEnv* env, jclass, jlong context, jbyteArray path, jobjectArray names, jobjectArray buffers, jint threads,
 jint long_side_px, jfloat score_threshold, jint max_people, jint result_pool_size, jint max_proposals,
 jint key_frame_interval, jint min_person_height_px, jint detail, jboolean allow_spinning, jint person_crops,
 jint person_crop_px) {
  return call(env, [&] {
    maq_densepose_config config;
    check(maq_densepose_config_init(&config, sizeof config));
    const std::string folder = maq_jni::text(env, path);
    const BundleFiles bundle(env, names, buffers);
    if (path != nullptr) config.bundle_path = folder.c_str();
    config.bundle_files = bundle.files.data();
    config.bundle_file_count = uint32_t(bundle.files.size());
    config.threads = threads;
    config.long_side_px = long_side_px;
    config.score_threshold = score_threshold;
    config.max_people = max_people;
    config.result_pool_size = uint32_t(result_pool_size);
    config.max_proposals = max_proposals;
    config.key_frame_interval = key_frame_interval;
    config.min_person_height_px = min_person_height_px;
    config.detail = maq_densepose_detail(detail);
    config.allow_spinning = allow_spinning;
    config.person_crops = maq_person_crops(person_crops);
    config.person_crop_px = person_crop_px;
    maq_densepose* densepose = nullptr;
    check(maq_densepose_create(object<maq_context>(context), &config, &densepose));
    return handle(densepose);
  });
}

MAQ_NATIVE(void, destroyDensePose)(JNIEnv*, jclass, jlong densepose) {
  maq_densepose_destroy(object<maq_densepose>(densepose));
}

MAQ_NATIVE(jlong, runDensePose)(JNIEnv* env, jclass, jlong densepose, jlong frame) {
  return call(env, [&] {
    maq_densepose_result* result = nullptr;
    check(maq_densepose_run(object<maq_densepose>(densepose), object<maq_frame>(frame), &result));
    return handle(result);
  });
}

MAQ_NATIVE(void, cancelDensePose)(JNIEnv* env, jclass, jlong densepose) {
  call(env, [&] { check(maq_densepose_cancel(object<maq_densepose>(densepose))); });
}

MAQ_NATIVE(void, resetDensePose)(JNIEnv* env, jclass, jlong densepose) {
  call(env, [&] { check(maq_densepose_reset(object<maq_densepose>(densepose))); });
}

MAQ_NATIVE(void, releaseResult)(JNIEnv*, jclass, jlong result) {
  maq_densepose_result_release(object<maq_densepose_result>(result));
}

// Width and height.
MAQ_NATIVE(jintArray, sizeOfResult)(JNIEnv* env, jclass, jlong result) {
  return call(env, [&]() -> jintArray {
    jint size[2];
    check(maq_densepose_result_get_size(object<maq_densepose_result>(result), &size[0], &size[1]));
    jintArray array = env->NewIntArray(2);
    maq_jni::check_pending(env);
    env->SetIntArrayRegion(array, 0, 2, size);
    return array;
  });
}

// Of each person left, top, right, bottom and score.
MAQ_NATIVE(jfloatArray, peopleOfResult)(JNIEnv* env, jclass, jlong result) {
  return call(env, [&]() -> jfloatArray {
    const auto* const from = object<maq_densepose_result>(result);
    std::vector<jfloat> values;
    for (uint32_t i = 0; i < maq_densepose_result_get_person_count(from); ++i) {
      maq_person person;
      person.struct_size = sizeof person;
      check(maq_densepose_result_get_person(from, i, &person));
      values.insert(values.end(), person.box_px, person.box_px + 4);
      values.push_back(person.score);
    }
    jfloatArray array = env->NewFloatArray(jsize(values.size()));
    maq_jni::check_pending(env);
    env->SetFloatArrayRegion(array, 0, jsize(values.size()), values.data());
    return array;
  });
}

// A plane as a direct buffer over the result's own memory; rows follow each other without padding.
MAQ_NATIVE(jobject, planeOfResult)(JNIEnv* env, jclass, jlong result, jint plane) {
  return call(env, [&]() -> jobject {
    auto* const from = object<maq_densepose_result>(result);
    const uint8_t* pixels = nullptr;
    size_t stride = 0;
    int32_t width = 0, height = 0;
    check(maq_densepose_result_get_size(from, &width, &height));
    check(maq_densepose_result_get_plane(from, maq_densepose_plane(plane), &pixels, &stride));
    if (stride != size_t(width)) throw maq_jni::StatusError{MAQ_ERROR_INTERNAL, "rows of a plane have padding"};
    // Java gets it read-only (Kotlin: asReadOnlyBuffer).
    return env->NewDirectByteBuffer(const_cast<uint8_t*>(pixels), jlong(stride) * height);
  });
}

// Times of the stages in milliseconds, then counts, in the order of maq_densepose_stats.
MAQ_NATIVE(jdoubleArray, statsOfResult)(JNIEnv* env, jclass, jlong result) {
  return call(env, [&]() -> jdoubleArray {
    maq_densepose_stats s;
    s.struct_size = sizeof s;
    check(maq_densepose_result_get_stats(object<maq_densepose_result>(result), &s));
    const jdouble values[] = {s.preprocess_ms,
                              s.trunk_ms,
                              s.proposals_ms,
                              s.box_head_ms,
                              s.dense_head_ms,
                              s.crops_ms,
                              s.decode_ms,
                              s.total_ms,
                              double(s.network_width_px),
                              double(s.network_height_px),
                              double(s.proposal_count),
                              double(s.person_count),
                              double(s.crop_count),
                              double(s.dropped_box_count),
                              double(s.body_pixel_count),
                              double(s.clamped_pixel_count),
                              double(s.is_key_frame)};
    constexpr jsize count = sizeof values / sizeof *values;
    jdoubleArray array = env->NewDoubleArray(count);
    maq_jni::check_pending(env);
    env->SetDoubleArrayRegion(array, 0, count, values);
    return array;
  });
}
