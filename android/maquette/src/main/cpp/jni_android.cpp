// Bitmaps, hardware buffers and surfaces of Android: they become frames, and results are drawn on them in place.
#include <cstring>
#include <memory>
#include <string>

#include "graphics/hardware_buffer.h"
#include "graphics/preview.h"
#include "jni_call.h"

using maq_jni::address_of;
using maq_jni::call;
using maq_jni::Canvas;
using maq_jni::check;
using maq_jni::object;
using maq_jni::Preview;
using maq_jni::StatusError;

namespace {

// Equals AndroidBitmapInfo of <android/bitmap.h>.
struct BitmapInfo {
  uint32_t width, height, stride;
  int32_t format;
  uint32_t flags;
};
constexpr int32_t kRgba8888 = 1;  // ANDROID_BITMAP_FORMAT_RGBA_8888

// The functions of libjnigraphics.so; they return 0 or an error.
struct BitmapFunctions {
  int (*get_info)(JNIEnv*, jobject, BitmapInfo*);
  int (*lock_pixels)(JNIEnv*, jobject, void**);
  int (*unlock_pixels)(JNIEnv*, jobject);
};

const BitmapFunctions& bitmap_functions() {
  static const BitmapFunctions found = [] {
    void* const library = maq_jni::open_android_library("libjnigraphics.so");
    BitmapFunctions functions{};
    const auto find = [&](const char* name, auto& function) {
      function =
          reinterpret_cast<std::remove_reference_t<decltype(function)>>(maq_jni::find_android_function(library, name));
    };
    find("AndroidBitmap_getInfo", functions.get_info);
    find("AndroidBitmap_lockPixels", functions.lock_pixels);
    find("AndroidBitmap_unlockPixels", functions.unlock_pixels);
    return functions;
  }();  // tried again when it throws
  return found;
}

// Gives `draw` the bitmap's pixels, locked.
template <typename Draw>
void with_bitmap(JNIEnv* env, jobject bitmap, const Draw& draw) {
  const BitmapFunctions& android = bitmap_functions();
  BitmapInfo info{};
  void* pixels = nullptr;
  int error = android.get_info(env, bitmap, &info);
  if (error == 0 && info.format != kRgba8888) maq_jni::refuse("The bitmap is not ARGB_8888.");
  if (error == 0) error = android.lock_pixels(env, bitmap, &pixels);
  if (error != 0 || pixels == nullptr) {
    throw StatusError{MAQ_ERROR_INVALID_ARGUMENT,
                      "The bitmap's pixels cannot be locked: error " + std::to_string(error) + "; it may be recycled."};
  }
  struct Lock {
    const BitmapFunctions& android;
    JNIEnv* env;
    jobject bitmap;
    ~Lock() { android.unlock_pixels(env, bitmap); }
  } const lock{android, env, bitmap};
  draw({int(info.width), int(info.height), static_cast<uint8_t*>(pixels), info.stride,
        size_t(info.stride) * info.height});
}

// The native object behind an object of Java, by a function of libandroid.so; it stays Java's or is referenced.
template <typename Native>
Native* native_of(JNIEnv* env, jobject of, const char* function) {
  static void* const library = maq_jni::open_android_library("libandroid.so");
  return reinterpret_cast<Native* (*)(JNIEnv*, jobject)>(maq_jni::find_android_function(library, function))(env, of);
}

AHardwareBuffer* buffer_of(JNIEnv* env, jobject buffer) {
  auto* const found = native_of<AHardwareBuffer>(env, buffer, "AHardwareBuffer_fromHardwareBuffer");
  if (found == nullptr) maq_jni::refuse("The hardware buffer has no memory; it may be closed.");
  return found;
}

// `onto`: an android.graphics.Bitmap, or an android.hardware.HardwareBuffer, which must have that size.
template <typename Draw>
void draw_on(JNIEnv* env, jobject onto, bool is_bitmap, int width_px, int height_px, const Draw& draw) {
  const auto draw_checked = [&](const Canvas& canvas) {
    if (canvas.width_px == width_px && canvas.height_px == height_px) return check(draw(canvas));
    const auto text = [](int width, int height) { return std::to_string(width) + " x " + std::to_string(height); };
    maq_jni::refuse("The image to draw on has " + text(canvas.width_px, canvas.height_px) +
                    " pixels, but the frame has " + text(width_px, height_px) + ".");
  };
  if (is_bitmap) return with_bitmap(env, onto, draw_checked);
  maq_jni::draw_on(maq_jni::graphics_functions(), buffer_of(env, onto), draw_checked);
}

}  // namespace

MAQ_NATIVE(Android, void, copyFrame)(JNIEnv* env, jclass, jlong frame, jobject onto, jboolean is_bitmap) {
  call(env, [&] {
    auto* const from = object<maq_frame>(frame);
    maq_frame_desc desc;
    check(maq_frame_desc_init(&desc, sizeof desc));
    check(maq_frame_get_desc(from, &desc));
    draw_on(env, onto, is_bitmap, desc.width_px, desc.height_px, [&](const Canvas& canvas) {
      return maq_frame_copy_pixels(from, MAQ_PIXEL_RGBA8, canvas.rgba, canvas.stride_bytes, canvas.size_bytes);
    });
  });
}

// `frame` 0: the people alone.
MAQ_NATIVE(Android, void, drawResult)
(JNIEnv* env, jclass, jlong result, jlong frame, jint opacity, jobject onto, jboolean is_bitmap) {
  call(env, [&] {
    auto* const from = object<maq_densepose_result>(result);
    int32_t width = 0, height = 0;
    check(maq_densepose_result_get_size(from, &width, &height));
    maq_densepose_drawing drawing;
    check(maq_densepose_drawing_init(&drawing, sizeof drawing));
    drawing.opacity = opacity == 0 ? MAQ_DENSEPOSE_INVISIBLE : opacity;
    draw_on(env, onto, is_bitmap, width, height, [&](const Canvas& canvas) {
      return maq_densepose_result_draw(from, object<maq_frame>(frame), &drawing, canvas.rgba, canvas.stride_bytes,
                                       canvas.size_bytes);
    });
  });
}

// A copy: the app may draw on the bitmap again.
MAQ_NATIVE(Android, jlong, frameOfBitmap)
(JNIEnv* env, jclass, jlong context, jobject bitmap, jlong timestamp_ns) {
  return call(env, [&] {
    maq_frame* frame = nullptr;
    with_bitmap(env, bitmap, [&](const Canvas& from) {
      const auto free = [](void* pixels) { delete[] static_cast<uint8_t*>(pixels); };
      auto pixels = std::make_unique<uint8_t[]>(from.size_bytes);
      std::memcpy(pixels.get(), from.rgba, from.size_bytes);
      maq_frame_desc desc;
      check(maq_frame_desc_init(&desc, sizeof desc));
      desc.format = MAQ_PIXEL_RGBA8;
      desc.width_px = from.width_px;
      desc.height_px = from.height_px;
      desc.planes[0] = pixels.get();
      desc.stride_bytes[0] = from.stride_bytes;
      desc.timestamp_ns = timestamp_ns;
      check(maq_frame_wrap(object<maq_context>(context), &desc, free, pixels.get(), &frame));
      pixels.release();
    });
    return address_of(frame);
  });
}

MAQ_NATIVE(Android, jlong, frameOfBuffer)
(JNIEnv* env, jclass, jlong context, jobject buffer, jobject image) {
  return call(env, [&] {
    const auto& like = *static_cast<const maq_yuv_image*>(maq_jni::address_in(env, image));
    const maq_jni::GraphicsFunctions& android = maq_jni::graphics_functions();
    return address_of(maq_jni::frame_of(android, buffer_of(env, buffer), object<maq_context>(context), like));
  });
}

MAQ_NATIVE(Android, jlong, createPreview)(JNIEnv* env, jclass) {
  return call(env, [&] { return address_of(new Preview(maq_jni::graphics_functions())); });
}

MAQ_NATIVE(Android, void, destroyPreview)(JNIEnv*, jclass, jlong preview) { delete object<Preview>(preview); }

MAQ_NATIVE(Android, void, setSurface)
(JNIEnv* env, jclass, jlong preview, jobject surface, jint width_px, jint height_px) {
  call(env, [&] {
    auto* const window =
        surface == nullptr ? nullptr : native_of<ANativeWindow>(env, surface, "ANativeWindow_fromSurface");
    object<Preview>(preview)->set_window(window, width_px, height_px);
  });
}

MAQ_NATIVE(Android, jboolean, drawOnSurface)
(JNIEnv* env, jclass, jlong preview, jlong frame, jlong result, jboolean fills, jint opacity, jboolean is_mirrored) {
  return call(env, [&]() -> jboolean {
    const maq_jni::PreviewStyle style{fills == JNI_TRUE ? maq_jni::Scaling::kFill : maq_jni::Scaling::kFit, opacity,
                                      is_mirrored == JNI_TRUE};
    return object<Preview>(preview)->draw(object<maq_frame>(frame), object<maq_densepose_result>(result), style)
               ? JNI_TRUE
               : JNI_FALSE;
  });
}
