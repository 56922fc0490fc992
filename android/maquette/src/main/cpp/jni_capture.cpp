// Captures: posed photos and a cloud in a folder.
#include "jni_config.h"

using maq_jni::call;
using maq_jni::check;
using maq_jni::handle;
using maq_jni::object;

MAQ_NATIVE_OF(NativeScene, jlong, openCapture)(JNIEnv* env, jclass, jlong context, jbyteArray folder) {
  return call(env, [&] {
    maq_capture* capture = nullptr;
    check(maq_capture_open(object<maq_context>(context), maq_jni::text(env, folder).c_str(), &capture));
    return handle(capture);
  });
}

MAQ_NATIVE_OF(NativeScene, void, closeCapture)(JNIEnv*, jclass, jlong capture) {
  maq_capture_destroy(object<maq_capture>(capture));
}

// Counts of views, points and drops, then the up vector.
MAQ_NATIVE_OF(NativeScene, jdoubleArray, captureInfo)(JNIEnv* env, jclass, jlong capture) {
  return call(env, [&] {
    maq_capture_info info{};
    info.struct_size = sizeof info;
    check(maq_capture_get_info(object<maq_capture>(capture), &info));
    return maq_jni::doubles_of(env, {double(info.view_count), double(info.point_count), double(info.drop_count),
                                     info.up[0], info.up[1], info.up[2]});
  });
}

// The camera of a view, then 1 if it is held out.
MAQ_NATIVE_OF(NativeScene, jdoubleArray, viewNumbers)(JNIEnv* env, jclass, jlong capture, jint index) {
  return call(env, [&] {
    maq_capture_view view{};
    view.struct_size = sizeof view;
    check(maq_capture_get_view(object<maq_capture>(capture), uint32_t(index), &view));
    std::vector<jdouble> values = maq_jni::values_of(view.camera);
    values.push_back(view.is_held_out);
    return maq_jni::doubles_of(env, values);
  });
}

MAQ_NATIVE_OF(NativeScene, jbyteArray, viewName)(JNIEnv* env, jclass, jlong capture, jint index) {
  return call(env, [&] {
    maq_capture_view view{};
    view.struct_size = sizeof view;
    check(maq_capture_get_view(object<maq_capture>(capture), uint32_t(index), &view));
    return maq_jni::bytes_of(env, view.name);
  });
}

// Writes the count of dropped parts to `count`; returns the reason.
MAQ_NATIVE_OF(NativeScene, jbyteArray, drop)(JNIEnv* env, jclass, jlong capture, jint index, jlongArray count) {
  return call(env, [&] {
    maq_capture_drop drop{};
    drop.struct_size = sizeof drop;
    check(maq_capture_get_drop(object<maq_capture>(capture), uint32_t(index), &drop));
    const auto dropped = jlong(drop.count);
    env->SetLongArrayRegion(count, 0, 1, &dropped);
    return maq_jni::bytes_of(env, drop.reason);
  });
}

MAQ_NATIVE_OF(NativeScene, jlong, loadView)(JNIEnv* env, jclass, jlong capture, jint index) {
  return call(env, [&] {
    maq_frame* frame = nullptr;
    check(maq_capture_load_view(object<maq_capture>(capture), uint32_t(index), &frame));
    return handle(frame);
  });
}
