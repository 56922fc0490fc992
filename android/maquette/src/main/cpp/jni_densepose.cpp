// Dense pose: networks, runs and results.
#include <vector>

#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;

MAQ_NATIVE(jlong, createDensePose)
(JNIEnv* env, jclass, jlong context, jbyteArray folder, jobjectArray names, jobjectArray buffers, jdoubleArray values) {
  return call(env, [&] {
    const maq_jni::Bundle bundle(env, folder, names, buffers);
    const maq_densepose_config config = maq_jni::densepose_config(env, bundle, values);
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

MAQ_NATIVE(void, setRollOfDensePose)(JNIEnv* env, jclass, jlong densepose, jfloat roll_rad) {
  call(env, [&] { check(maq_densepose_set_roll(object<maq_densepose>(densepose), roll_rad)); });
}

MAQ_NATIVE(void, resetDensePose)(JNIEnv* env, jclass, jlong densepose) {
  call(env, [&] { check(maq_densepose_reset(object<maq_densepose>(densepose))); });
}

// [24][nodes][nodes][3]; null where the bundle has no surface.
MAQ_NATIVE(jfloatArray, surfaceOfDensePose)(JNIEnv* env, jclass, jlong densepose) {
  return call(env, [&] {
    maq_densepose_surface surface{};
    surface.struct_size = sizeof surface;
    const maq_status status = maq_densepose_get_surface(object<maq_densepose>(densepose), &surface);
    return maq_jni::points_of(env, status, surface);
  });
}

MAQ_NATIVE(void, releaseResult)(JNIEnv*, jclass, jlong result) {
  maq_densepose_result_release(object<maq_densepose_result>(result));
}

MAQ_NATIVE(void, saveResult)(JNIEnv* env, jclass, jlong result, jbyteArray path) {
  call(env, [&] {
    const std::string to = maq_jni::text(env, path);
    check(maq_densepose_result_save(object<maq_densepose_result>(result), to.c_str()));
  });
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
      maq_densepose_person person;
      person.struct_size = sizeof person;
      check(maq_densepose_result_get_person(from, i, &person));
      values.insert(values.end(), person.box_px, person.box_px + 4);
      values.push_back(person.score);
    }
    return maq_jni::floats_of(env, values.data(), values.size());
  });
}

// Left, top, right and bottom; null where none of the person's head is seen.
MAQ_NATIVE(jfloatArray, headBoxOfResult)(JNIEnv* env, jclass, jlong result, jint person) {
  return call(env, [&]() -> jfloatArray {
    jfloat box[4];
    const maq_status status =
        maq_densepose_result_get_head_box(object<maq_densepose_result>(result), uint32_t(person), box);
    if (status == MAQ_ERROR_NOT_FOUND) return nullptr;
    check(status);
    return maq_jni::floats_of(env, box, 4);
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
    return maq_jni::doubles_of(env, {s.preprocess_ms,
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
                                     double(s.is_key_frame),
                                     double(s.provider),
                                     double(s.threads),
                                     double(s.is_threads_measured)});
  });
}
