// Declarations of <android/hardware_buffer.h> and <android/native_window.h>: from the NDK, or copies of the needed ones
// without an NDK. The functions are looked up at run time, so that a test can take Android's place.
#pragma once

#include <cstdint>

#if __has_include(<android/native_window.h>)
#include <android/hardware_buffer.h>
#include <android/native_window.h>
#else
struct AHardwareBuffer;
struct ANativeWindow;
struct ARect;

enum : uint32_t {
  AHARDWAREBUFFER_FORMAT_R8G8B8A8_UNORM = 1,
  AHARDWAREBUFFER_FORMAT_R8G8B8X8_UNORM = 2,
  AHARDWAREBUFFER_FORMAT_R8G8B8_UNORM = 3,
  AHARDWAREBUFFER_FORMAT_Y8Cb8Cr8_420 = 0x23,
};
enum : uint64_t {
  AHARDWAREBUFFER_USAGE_CPU_READ_OFTEN = 3,
  AHARDWAREBUFFER_USAGE_CPU_READ_MASK = 0xf,
  AHARDWAREBUFFER_USAGE_CPU_WRITE_OFTEN = 3 << 4,
  AHARDWAREBUFFER_USAGE_CPU_WRITE_MASK = 0xf << 4,
  AHARDWAREBUFFER_USAGE_PROTECTED_CONTENT = 1 << 14,
};
enum : int32_t { WINDOW_FORMAT_RGBA_8888 = 1 };

struct AHardwareBuffer_Desc {
  uint32_t width, height, layers, format;
  uint64_t usage;
  uint32_t stride;  // in pixels
  uint32_t rfu0;
  uint64_t rfu1;
};
struct AHardwareBuffer_Plane {
  void* data;
  uint32_t pixelStride, rowStride;  // in bytes
};
struct AHardwareBuffer_Planes {
  uint32_t planeCount;
  AHardwareBuffer_Plane planes[4];
};
struct ANativeWindow_Buffer {
  int32_t width, height;
  int32_t stride;  // in pixels
  int32_t format;
  void* bits;
  uint32_t reserved[6];
};
#endif

namespace maq_jni {

#define MAQ_FUNCTIONS_OF_NATIVEWINDOW(F)                                                               \
  F(AHardwareBuffer_acquire, void(AHardwareBuffer*))                                                   \
  F(AHardwareBuffer_release, void(AHardwareBuffer*))                                                   \
  F(AHardwareBuffer_describe, void(const AHardwareBuffer*, AHardwareBuffer_Desc*))                     \
  F(AHardwareBuffer_lock, int(AHardwareBuffer*, uint64_t, int32_t fence, const ARect*, void** pixels)) \
  F(AHardwareBuffer_unlock, int(AHardwareBuffer*, int32_t * fence))                                    \
  F(ANativeWindow_release, void(ANativeWindow*))                                                       \
  F(ANativeWindow_setBuffersGeometry, int32_t(ANativeWindow*, int32_t, int32_t, int32_t format))       \
  F(ANativeWindow_lock, int32_t(ANativeWindow*, ANativeWindow_Buffer*, ARect* dirty))                  \
  F(ANativeWindow_unlockAndPost, int32_t(ANativeWindow*))

struct GraphicsFunctions {
#define MAQ_FUNCTION(name, signature) \
  using Type_##name = signature;      \
  Type_##name* name = nullptr;
  MAQ_FUNCTIONS_OF_NATIVEWINDOW(MAQ_FUNCTION)
#undef MAQ_FUNCTION
  // Exists since Android 10 (API level 29); null before.
  int (*AHardwareBuffer_lockPlanes)(AHardwareBuffer*, uint64_t, int32_t fence, const ARect*,
                                    AHardwareBuffer_Planes*) = nullptr;
};

// Opens libnativewindow.so with the first call. Throws MAQ_ERROR_RUNTIME_LIBRARY.
const GraphicsFunctions& graphics_functions();

// A library of Android's, which stays open. Throws MAQ_ERROR_RUNTIME_LIBRARY.
void* open_android_library(const char* name);
// Throws MAQ_ERROR_RUNTIME_LIBRARY where `library` does not have it.
void* find_android_function(void* library, const char* name);

}  // namespace maq_jni
