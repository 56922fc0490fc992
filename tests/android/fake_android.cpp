// libandroid.so, libnativewindow.so and libjnigraphics.so on this machine: Android's functions over Robolectric's
// bitmaps, and over hardware buffers and windows in memory, and what dev.maquette.FakeAndroid asks of them.
#include <jni.h>

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "support/fakes/fake_ndk_graphics.h"

#define EXPORTED extern "C" __attribute__((visibility("default")))
#define OF_FAKE(type, name) EXPORTED type JNICALL Java_dev_maquette_FakeAndroid_##name

namespace {

FakeNdkGraphics graphics;
std::mutex mutex;  // of all that follows
std::map<jint, AHardwareBuffer*> buffers;
std::map<jint, ANativeWindow*> windows;
std::map<jint, std::vector<uint8_t>> locked_bitmaps;
std::string bitmap_misuse;

// As JNI asks for after each call; the tests' own objects throw nothing.
template <class Value>
Value checked(JNIEnv* env, Value value) {
  if (env->ExceptionCheck()) env->FatalError("a test's object threw an exception");
  return value;
}

jint number(JNIEnv* env, jobject object, const char* method) {
  return checked(env, env->CallIntMethod(object, env->GetMethodID(env->GetObjectClass(object), method, "()I")));
}

// Which Java object it is.
jint identity(JNIEnv* env, jobject object) {
  jclass system = env->FindClass("java/lang/System");
  jmethodID method = env->GetStaticMethodID(system, "identityHashCode", "(Ljava/lang/Object;)I");
  return checked(env, env->CallStaticIntMethod(system, method, object));
}

// Under the lock.
ANativeWindow* window_of(jint surface) {
  ANativeWindow*& window = windows[surface];
  if (window == nullptr) {
    window = graphics.make_window();
    FakeNdkGraphics::ANativeWindow_release(window);
  }
  return window;
}

AHardwareBuffer* buffer_of(JNIEnv* env, jobject object) {
  const jint key = identity(env, object);
  const std::lock_guard<std::mutex> lock(mutex);
  AHardwareBuffer*& buffer = buffers[key];
  if (buffer != nullptr) return buffer;
  jmethodID usage = env->GetMethodID(env->GetObjectClass(object), "getUsage", "()J");
  const auto format = uint32_t(number(env, object, "getFormat"));
  const auto width = uint32_t(number(env, object, "getWidth")), height = uint32_t(number(env, object, "getHeight"));
  buffer = format == AHARDWAREBUFFER_FORMAT_Y8Cb8Cr8_420 ? graphics.make_yuv(width, height, 2, 1)
                                                         : graphics.make_buffer(format, width, height);
  buffer->desc.usage = uint64_t(checked(env, env->CallLongMethod(object, usage)));
  return buffer;
}

void copy_pixels(JNIEnv* env, jobject bitmap, const char* method, std::vector<uint8_t>& pixels) {
  jobject buffer = env->NewDirectByteBuffer(pixels.data(), jlong(pixels.size()));
  jmethodID copy = env->GetMethodID(env->GetObjectClass(bitmap), method, "(Ljava/nio/Buffer;)V");
  env->CallVoidMethod(bitmap, copy, buffer);
  checked(env, 0);
  env->DeleteLocalRef(buffer);
}

// Robolectric has blue first in memory, Android red.
void swap_red_and_blue(std::vector<uint8_t>& pixels) {
  for (size_t i = 0; i + 4 <= pixels.size(); i += 4) std::swap(pixels[i], pixels[i + 2]);
}

}  // namespace

// --- Android's

EXPORTED void AHardwareBuffer_acquire(AHardwareBuffer* buffer) { FakeNdkGraphics::AHardwareBuffer_acquire(buffer); }
EXPORTED void AHardwareBuffer_release(AHardwareBuffer* buffer) { FakeNdkGraphics::AHardwareBuffer_release(buffer); }
EXPORTED void AHardwareBuffer_describe(const AHardwareBuffer* buffer, AHardwareBuffer_Desc* desc) {
  FakeNdkGraphics::AHardwareBuffer_describe(buffer, desc);
}
EXPORTED int AHardwareBuffer_lock(AHardwareBuffer* buffer, uint64_t usage, int32_t fence, const ARect* area,
                                  void** pixels) {
  return FakeNdkGraphics::AHardwareBuffer_lock(buffer, usage, fence, area, pixels);
}
EXPORTED int AHardwareBuffer_lockPlanes(AHardwareBuffer* buffer, uint64_t usage, int32_t fence, const ARect* area,
                                        AHardwareBuffer_Planes* planes) {
  return FakeNdkGraphics::AHardwareBuffer_lockPlanes(buffer, usage, fence, area, planes);
}
EXPORTED int AHardwareBuffer_unlock(AHardwareBuffer* buffer, int32_t* fence) {
  return FakeNdkGraphics::AHardwareBuffer_unlock(buffer, fence);
}
EXPORTED AHardwareBuffer* AHardwareBuffer_fromHardwareBuffer(JNIEnv* env, jobject buffer) {
  return buffer_of(env, buffer);
}

EXPORTED void ANativeWindow_release(ANativeWindow* window) { FakeNdkGraphics::ANativeWindow_release(window); }
EXPORTED int32_t ANativeWindow_setBuffersGeometry(ANativeWindow* window, int32_t width, int32_t height,
                                                  int32_t format) {
  return FakeNdkGraphics::ANativeWindow_setBuffersGeometry(window, width, height, format);
}
EXPORTED int32_t ANativeWindow_lock(ANativeWindow* window, ANativeWindow_Buffer* buffer, ARect* dirty) {
  return FakeNdkGraphics::ANativeWindow_lock(window, buffer, dirty);
}
EXPORTED int32_t ANativeWindow_unlockAndPost(ANativeWindow* window) {
  return FakeNdkGraphics::ANativeWindow_unlockAndPost(window);
}
EXPORTED ANativeWindow* ANativeWindow_fromSurface(JNIEnv* env, jobject surface) {
  const jint key = identity(env, surface);
  const std::lock_guard<std::mutex> lock(mutex);
  ANativeWindow* const window = window_of(key);
  ++window->references;
  return window;
}

// As AndroidBitmapInfo.
struct BitmapInfo {
  uint32_t width, height, stride;
  int32_t format;
  uint32_t flags;
};
EXPORTED int AndroidBitmap_getInfo(JNIEnv* env, jobject bitmap, BitmapInfo* info) {
  *info = {uint32_t(number(env, bitmap, "getWidth")), uint32_t(number(env, bitmap, "getHeight")),
           uint32_t(number(env, bitmap, "getRowBytes")), 1, 0};
  return 0;
}
EXPORTED int AndroidBitmap_lockPixels(JNIEnv* env, jobject bitmap, void** pixels) {
  jmethodID is_recycled = env->GetMethodID(env->GetObjectClass(bitmap), "isRecycled", "()Z");
  if (checked(env, env->CallBooleanMethod(bitmap, is_recycled)) == JNI_TRUE) return -2;
  const jint key = identity(env, bitmap);
  std::vector<uint8_t> copy(size_t(number(env, bitmap, "getRowBytes")) * size_t(number(env, bitmap, "getHeight")));
  copy_pixels(env, bitmap, "copyPixelsToBuffer", copy);
  swap_red_and_blue(copy);
  const std::lock_guard<std::mutex> lock(mutex);
  if (locked_bitmaps.count(key) != 0) bitmap_misuse += "a bitmap is locked twice; ";
  *pixels = (locked_bitmaps[key] = std::move(copy)).data();
  return 0;
}
EXPORTED int AndroidBitmap_unlockPixels(JNIEnv* env, jobject bitmap) {
  const jint key = identity(env, bitmap);
  std::vector<uint8_t> pixels;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    pixels = std::move(locked_bitmaps[key]);
    locked_bitmaps.erase(key);
  }
  swap_red_and_blue(pixels);
  copy_pixels(env, bitmap, "copyPixelsFromBuffer", pixels);
  return 0;
}

// --- the test's

// The pixels of a hardware buffer, rows of its width + 8.
OF_FAKE(jobject, memoryOf)(JNIEnv* env, jclass, jobject buffer) {
  AHardwareBuffer* const found = buffer_of(env, buffer);
  return env->NewDirectByteBuffer(found->memory.data(), jlong(found->memory.size()));
}

// Returns the content of a surface: width, height, how many pictures it got, then the pixels as 0xAABBGGRR.
OF_FAKE(jintArray, shownOn)(JNIEnv* env, jclass, jobject surface) {
  const jint key = identity(env, surface);
  FakeNdkGraphics::Picture picture{};
  {
    const std::lock_guard<std::mutex> lock(mutex);
    picture = graphics.shown(window_of(key));
  }
  const jint head[] = {picture.width, picture.height, picture.posts};
  jintArray all = env->NewIntArray(jsize(3 + picture.pixels.size()));
  env->SetIntArrayRegion(all, 0, 3, head);
  env->SetIntArrayRegion(all, 3, jsize(picture.pixels.size()), reinterpret_cast<const jint*>(picture.pixels.data()));
  return all;
}

// As when surfaceDestroyed() has returned.
OF_FAKE(void, takeAway)(JNIEnv* env, jclass, jobject surface) {
  const jint key = identity(env, surface);
  const std::lock_guard<std::mutex> lock(mutex);
  graphics.take_away(window_of(key));
}

OF_FAKE(jstring, misuse)(JNIEnv* env, jclass) {
  const std::lock_guard<std::mutex> lock(mutex);
  std::string all = graphics.misuse() + bitmap_misuse;
  if (!locked_bitmaps.empty()) all += "a bitmap is locked; ";
  return env->NewStringUTF(all.c_str());
}
