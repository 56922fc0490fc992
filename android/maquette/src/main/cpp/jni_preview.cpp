// Results on a Surface (graphics/preview.h).
#include "graphics/preview.h"
#include "jni_call.h"

using maq_jni::call;
using maq_jni::handle;
using maq_jni::object;
using maq_jni::Preview;

namespace {

// A reference to the window; null of a surface that is gone already.
ANativeWindow* window_of(JNIEnv* env, jobject surface) {
  using FromSurface = ANativeWindow*(JNIEnv*, jobject);
  static FromSurface* const from_surface = reinterpret_cast<FromSurface*>(
      maq_jni::find_android_function(maq_jni::open_android_library("libandroid.so"), "ANativeWindow_fromSurface"));
  return surface == nullptr ? nullptr : from_surface(env, surface);
}

}  // namespace

MAQ_NATIVE_OF(NativePreview, jlong, create)(JNIEnv* env, jclass) {
  return call(env, [&] { return handle(new Preview(maq_jni::graphics_functions())); });
}

MAQ_NATIVE_OF(NativePreview, void, destroy)(JNIEnv*, jclass, jlong preview) { delete object<Preview>(preview); }

MAQ_NATIVE_OF(NativePreview, void, setSurface)
(JNIEnv* env, jclass, jlong preview, jobject surface, jint width_px, jint height_px) {
  call(env, [&] { object<Preview>(preview)->set_window(window_of(env, surface), width_px, height_px); });
}

MAQ_NATIVE_OF(NativePreview, jboolean, draw)
(JNIEnv* env, jclass, jlong preview, jlong frame, jlong result, jboolean fills, jint opacity, jboolean is_mirrored) {
  return call(env, [&]() -> jboolean {
    const maq_jni::PreviewStyle style{fills == JNI_TRUE ? maq_jni::Scaling::kFill : maq_jni::Scaling::kFit, opacity,
                                      is_mirrored == JNI_TRUE};
    return object<Preview>(preview)->draw(object<maq_frame>(frame), object<maq_densepose_result>(result), style)
               ? JNI_TRUE
               : JNI_FALSE;
  });
}
