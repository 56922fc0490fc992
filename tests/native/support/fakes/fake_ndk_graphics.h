// Android's hardware buffers and windows in memory, for maq_jni::GraphicsFunctions: what the NDK does, every way it may
// fail, and the mistakes that end an app on a phone, noted in misuse(). For tests of C++, and for those of Kotlin
// (tests/android/fake_android.cpp).
#pragma once

#include <cerrno>
#include <climits>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "graphics/ndk_graphics.h"

struct AHardwareBuffer {
  AHardwareBuffer_Desc desc;
  std::vector<uint8_t> memory;
  std::vector<AHardwareBuffer_Plane> planes;  // of YUV
  int references = 1;                         // the test's
  int locks = 0;
};

struct ANativeWindow {
  int references = 1;  // the test's
  int width = 0, height = 0;
  bool is_locked = false, is_gone = false;
  std::vector<uint32_t> memory;  // of the buffer that is drawn on
  // The last posted pixels, without the padding of rows.
  std::vector<uint32_t> shown;
  int shown_width = 0, shown_height = 0, posts = 0;
};

class FakeNdkGraphics {
 public:
  FakeNdkGraphics() { current() = this; }
  ~FakeNdkGraphics() { current() = nullptr; }
  FakeNdkGraphics(const FakeNdkGraphics&) = delete;
  FakeNdkGraphics& operator=(const FakeNdkGraphics&) = delete;

  static maq_jni::GraphicsFunctions functions() {
    maq_jni::GraphicsFunctions all;
#define MAQ_FUNCTION(name, signature) all.name = &FakeNdkGraphics::name;
    MAQ_FUNCTIONS_OF_NATIVEWINDOW(MAQ_FUNCTION)
#undef MAQ_FUNCTION
    all.AHardwareBuffer_lockPlanes = &FakeNdkGraphics::AHardwareBuffer_lockPlanes;
    return all;
  }

  // --- what a test does

  // Rows of `width` + 8 pixels, whose bytes count from 0.
  AHardwareBuffer* make_buffer(uint32_t format, uint32_t width, uint32_t height,
                               uint64_t usage = AHARDWAREBUFFER_USAGE_CPU_READ_OFTEN |
                                                AHARDWAREBUFFER_USAGE_CPU_WRITE_OFTEN) {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto buffer = std::make_unique<AHardwareBuffer>();
    buffer->desc = {width, height, 1, format, usage, width + 8, 0, 0};
    buffer->memory.resize(size_t(width + 8) * height * 4);
    for (size_t i = 0; i < buffer->memory.size(); ++i) buffer->memory[i] = uint8_t(i * 7 + i / 256);
    buffers_.push_back(std::move(buffer));
    return buffers_.back().get();
  }
  // YUV as phones have it: V and U in turns where `step` is 2 and `u_at` 1, U and V where it is 0; planes apart where
  // it is 1.
  AHardwareBuffer* make_yuv(uint32_t width, uint32_t height, uint32_t step, uint32_t u_at) {
    AHardwareBuffer* const buffer = make_buffer(AHARDWAREBUFFER_FORMAT_Y8Cb8Cr8_420, width, height);
    const uint32_t columns = (width + 1) / 2, stride = width + 8, chroma_stride = columns * step + 6;
    uint8_t* const luma = buffer->memory.data();
    uint8_t* const chroma = luma + size_t(stride) * height;
    const size_t apart = size_t(chroma_stride) * ((height + 1) / 2);
    uint8_t* const u = step == 1 ? chroma : chroma + u_at;
    uint8_t* const v = step == 1 ? chroma + apart : chroma + (1 - u_at);
    buffer->planes = {{luma, 1, stride}, {u, step, chroma_stride}, {v, step, chroma_stride}};
    return buffer;
  }
  ANativeWindow* make_window() {
    const std::lock_guard<std::mutex> lock(mutex_);
    windows_.push_back(std::make_unique<ANativeWindow>());
    ++windows_.back()->references;  // of who gets it
    return windows_.back().get();
  }
  // From now on the function fails `times` times with `error`, after so many calls that work.
  void break_call(const std::string& name, int error, int after = 0, int times = INT_MAX) {
    const std::lock_guard<std::mutex> lock(mutex_);
    faults_[name] = {error, after, times};
  }
  // Buffers have another size than asked for, or no memory, in so many images.
  void give_other_buffers(int times, bool have_no_memory = false) {
    const std::lock_guard<std::mutex> lock(mutex_);
    other_buffers_ = times;
    have_no_memory_ = have_no_memory;
  }
  // The window's surface goes: using the window afterwards is a mistake.
  void take_away(ANativeWindow* window) {
    const std::lock_guard<std::mutex> lock(mutex_);
    window->is_gone = true;
  }
  struct Picture {
    std::vector<uint32_t> pixels;
    int width, height, posts;
  };
  Picture shown(const ANativeWindow* window) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return {window->shown, window->shown_width, window->shown_height, window->posts};
  }

  std::string misuse() {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::string all = misuse_;
    for (const auto& buffer : buffers_) {
      if (buffer->references != 1) all += "a buffer is kept; ";
      if (buffer->locks != 0) all += "a buffer is locked; ";
    }
    for (const auto& window : windows_) {
      if (window->references != 1) all += "a window is kept; ";
      if (window->is_locked) all += "a window is locked; ";
    }
    return all;
  }

  // --- what the code calls

  static void AHardwareBuffer_acquire(AHardwareBuffer* buffer) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    ++buffer->references;
  }
  static void AHardwareBuffer_release(AHardwareBuffer* buffer) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (--buffer->references < 1) self().note("a buffer is released twice");
    if (buffer->references == 1 && buffer->locks != 0) self().note("a buffer is released while it is locked");
  }
  static void AHardwareBuffer_describe(const AHardwareBuffer* buffer, AHardwareBuffer_Desc* desc) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    *desc = buffer->desc;
  }
  static int AHardwareBuffer_lock(AHardwareBuffer* buffer, uint64_t usage, int32_t fence, const ARect* area,
                                  void** pixels) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (const int error = self().begin_lock("AHardwareBuffer_lock", *buffer, usage, fence, area)) return error;
    *pixels = buffer->memory.data();
    return 0;
  }
  static int AHardwareBuffer_lockPlanes(AHardwareBuffer* buffer, uint64_t usage, int32_t fence, const ARect* area,
                                        AHardwareBuffer_Planes* planes) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (const int error = self().begin_lock("AHardwareBuffer_lockPlanes", *buffer, usage, fence, area)) return error;
    planes->planeCount = uint32_t(buffer->planes.size());
    for (size_t i = 0; i < buffer->planes.size(); ++i) planes->planes[i] = buffer->planes[i];
    return 0;
  }
  static int AHardwareBuffer_unlock(AHardwareBuffer* buffer, int32_t* fence) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (--buffer->locks < 0) self().note("a buffer is unlocked twice");
    if (fence != nullptr) self().note("the fence of unlock is not waited for");
    return 0;
  }
  static void ANativeWindow_release(ANativeWindow* window) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (window->is_locked) self().note("a window is released while it is locked");
    if (--window->references < 1) self().note("a window is released twice");
  }
  static int32_t ANativeWindow_setBuffersGeometry(ANativeWindow* window, int32_t width, int32_t height,
                                                  int32_t format) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (!self().may_use(*window)) return -EINVAL;
    if (width < 1 || height < 1 || format != WINDOW_FORMAT_RGBA_8888) self().note("a geometry that cannot be");
    if (const int error = self().fails("ANativeWindow_setBuffersGeometry")) return error;
    window->width = width;
    window->height = height;
    return 0;
  }
  static int32_t ANativeWindow_lock(ANativeWindow* window, ANativeWindow_Buffer* buffer, ARect* dirty) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (!self().may_use(*window)) return -EINVAL;
    if (window->is_locked) self().note("a window is locked twice");
    if (dirty != nullptr) self().note("what lies outside of the dirty part is unknown");
    if (const int error = self().fails("ANativeWindow_lock")) return error;
    window->is_locked = true;
    const bool is_other = self().other_buffers_ > 0 && self().other_buffers_-- > 0;
    const int width = is_other && !self().have_no_memory_ ? window->width / 2 + 1 : window->width;
    window->memory.assign(size_t(width + kPadding) * size_t(window->height), 0xdeadbeef);
    *buffer = {width, window->height, width + kPadding, WINDOW_FORMAT_RGBA_8888, window->memory.data(), {}};
    if (is_other && self().have_no_memory_) buffer->bits = nullptr;
    return 0;
  }
  static int32_t ANativeWindow_unlockAndPost(ANativeWindow* window) {
    const std::lock_guard<std::mutex> lock(self().mutex_);
    if (!self().may_use(*window)) return -EINVAL;
    if (!window->is_locked) self().note("a window is posted that is not locked");
    window->is_locked = false;
    const int error = self().fails("ANativeWindow_unlockAndPost");
    if (error != 0) return error;
    const size_t stride = window->memory.size() / size_t(window->height);
    const size_t width = stride - kPadding;
    window->shown.clear();
    for (size_t y = 0; y < size_t(window->height); ++y) {
      const auto row = window->memory.begin() + std::ptrdiff_t(y * stride);
      window->shown.insert(window->shown.end(), row, row + std::ptrdiff_t(width));
      for (size_t x = width; x < stride; ++x) {
        if (row[std::ptrdiff_t(x)] != 0xdeadbeef) self().note("pixels behind a row are written");
      }
    }
    window->shown_width = int(width);
    window->shown_height = window->height;
    ++window->posts;
    return 0;
  }

 private:
  static constexpr int kPadding = 5;
  struct Fault {
    int error, after, times;
  };

  static FakeNdkGraphics*& current() {
    static FakeNdkGraphics* fake = nullptr;
    return fake;
  }
  static FakeNdkGraphics& self() { return *current(); }

  // Under the lock, all of these.
  void note(const std::string& mistake) { misuse_ += mistake + "; "; }
  int fails(const std::string& name) {
    const auto found = faults_.find(name);
    if (found == faults_.end() || found->second.times == 0) return 0;
    if (found->second.after > 0) return --found->second.after, 0;
    --found->second.times;
    return found->second.error;
  }
  bool may_use(const ANativeWindow& window) {
    if (window.is_gone) note("a window is used that is gone");
    return !window.is_gone;
  }
  int begin_lock(const char* name, AHardwareBuffer& buffer, uint64_t usage, int32_t fence, const ARect* area) {
    constexpr uint64_t kCpu = AHARDWAREBUFFER_USAGE_CPU_READ_MASK | AHARDWAREBUFFER_USAGE_CPU_WRITE_MASK;
    if (fence != -1 || area != nullptr) note("a lock of a part, or behind a fence");
    if ((usage & ~kCpu) != 0 || (buffer.desc.usage & usage) != usage || buffer.desc.layers != 1) {
      note("a lock for what the buffer is not made for");
    }
    const int error = fails(name);
    if (error == 0) ++buffer.locks;
    return error;
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<AHardwareBuffer>> buffers_;
  std::vector<std::unique_ptr<ANativeWindow>> windows_;
  std::map<std::string, Fault> faults_;
  int other_buffers_ = 0;
  bool have_no_memory_ = false;
  std::string misuse_;
};
