// The kind of a handle, whether the app holds it, and its process. Misuse is detected before an object is touched.
#pragma once

#include <atomic>
#include <cstdint>

namespace maq {

// How many calls of fork() lie between this process and the first that loaded the library.
uint32_t fork_count();

enum class HandleKind : uint32_t {
  kContext = 1,
  kFrame,
  kSource,
  kCameraList,
  kRecorder,
  kClip,
  kDensePose,
  kDensePoseResult,
  kPipeline,
  kCapture,
  kScene,
  kSceneBuilder,
  kSceneRenderer,
  kImage,
  kEdges,
  kEdgesResult,
  kEdgesCurves,
  kEdgesFusion,
  kHead,
  kHeadBuilder,
  kHeadRenderer,
  kHeadMesh,
  kPredictor,
  kConcealer,
  kCameraHealth,
  kModel,
  kBody,
  kBodyResult,
  kBodyClip,
  kDensePoseTexture,
  kPipelineResult,
  kDenseCloud
};

class HandleState {
 public:
  explicit HandleState(HandleKind kind) : HandleState(kind, 0) {}

  // For any kind of handle.
  bool is_held() const;
  bool is_held_as(HandleKind kind) const {
    return (word_.load(std::memory_order_relaxed) & ~(kInUse | kPart)) == held(kind);
  }
  // In a child of fork(), the objects of the parent have no threads, their mutexes may be locked for good, and their
  // files and devices are the parent's: nothing may touch them.
  bool is_of_parent() const { return has_mark() && forks_ != fork_count(); }
  // Throws ArgumentError: why is_held_as() is false. `name` is the argument's.
  [[noreturn]] void refuse(HandleKind kind, const char* name) const;

  // For calls that run one at a time on a handle: false when another runs, or the handle is of another kind.
  bool begin_call(HandleKind kind) {
    uint32_t expected = held(kind) | (word_.load(std::memory_order_relaxed) & kPart);
    return word_.compare_exchange_strong(expected, expected | kInUse, std::memory_order_acquire,
                                         std::memory_order_relaxed);
  }
  void end_call() { word_.fetch_and(~kInUse, std::memory_order_release); }

  // From the app; false when the handle is of another kind or was returned. `is_in_use`, and false: a call runs, so the
  // app keeps it.
  bool mark_returned(HandleKind kind, bool even_in_use, bool& is_in_use);
  // To the app, from a pool.
  void lend() { word_.fetch_and(~(kGivenBack | kInUse), std::memory_order_relaxed); }
  // For a handle inside another: the app has it and gives it back with the whole; it cannot give back the part alone.
  void lend_part() {
    word_.fetch_or(kPart, std::memory_order_relaxed);
    lend();
  }
  void take_back_part() { word_.fetch_or(kPart | kGivenBack, std::memory_order_relaxed); }

  // Takes the memory of a handle that is gone. It is kept for a while, with a state at its beginning that says so: for
  // an app that still has the address.
  static void retire(void* memory, HandleKind kind) noexcept;

 private:
  HandleState(HandleKind kind, uint32_t flags) : word_(held(kind) | flags), forks_(fork_count()) {}

  bool has_mark() const { return (word_.load(std::memory_order_relaxed) & kMarkBits) == kMark; }

  static constexpr uint32_t kMark = 0x4d510000, kMarkBits = 0xffff0000;  // unlike common fill patterns of memory
  static constexpr uint32_t kInUse = 1, kGivenBack = 2, kPart = 4;
  static constexpr uint32_t held(HandleKind kind) { return kMark | uint32_t(kind) << 8; }

  std::atomic<uint32_t> word_;
  uint32_t forks_;
};

}  // namespace maq
