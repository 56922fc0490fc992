#include "api/handle_state.h"

#include <cstddef>
#include <iterator>
#include <mutex>
#include <new>
#include <utility>

#include "api/boundary.h"

namespace maq {
namespace {

// In the order of HandleKind.
constexpr const char* kKinds[] = {"no handle",
                                  "a maq_context",
                                  "a maq_frame",
                                  "a maq_source",
                                  "a maq_camera_list",
                                  "a maq_recorder",
                                  "a maq_clip",
                                  "a maq_densepose",
                                  "a maq_densepose_result",
                                  "a maq_pipeline",
                                  "a maq_capture",
                                  "a maq_scene",
                                  "a maq_scene_builder",
                                  "a maq_scene_renderer",
                                  "a maq_image",
                                  "a maq_edges",
                                  "a maq_edges_result",
                                  "a maq_edges_curves",
                                  "a maq_edges_fusion",
                                  "a maq_head",
                                  "a maq_head_builder",
                                  "a maq_head_renderer",
                                  "a maq_head_mesh",
                                  "a maq_predictor",
                                  "a maq_concealer",
                                  "a maq_camera_health",
                                  "a maq_model",
                                  "a maq_body",
                                  "a maq_body_result",
                                  "a maq_body_clip",
                                  "a maq_densepose_texture",
                                  "a maq_pipeline_result",
                                  "a maq_dense_cloud"};
static_assert(std::size(kKinds) == size_t(HandleKind::kDenseCloud) + 1);

// The latest handles that are gone. Without a destructor: an app may destroy handles while the process ends.
struct RetiredHandles {
  static constexpr size_t kKept = 64;
  std::mutex mutex;
  void* memory[kKept] = {};
  size_t next = 0;
};
RetiredHandles retired;

}  // namespace

bool HandleState::is_held() const {
  const uint32_t word = word_.load(std::memory_order_relaxed);
  return (word & kMarkBits) == kMark && (word & kGivenBack) == 0;
}

void HandleState::refuse(HandleKind kind, const char* name) const {
  const uint32_t word = word_.load(std::memory_order_relaxed);
  const size_t found = (word & ~kMarkBits) >> 8;
  const char* const wanted = kKinds[size_t(kind)];
  if ((word & kMarkBits) != kMark || found == 0 || found >= std::size(kKinds)) {
    throw ArgumentError(name, " is not ", wanted, ", nor another object of this library.");
  }
  if (found != size_t(kind)) throw ArgumentError(name, " is ", kKinds[found], ", but must be ", wanted, ".");
  if ((word & (kPart | kGivenBack)) == kPart) {
    throw ArgumentError(name, " belongs to a result of a pipeline; release that with maq_pipeline_result_release.");
  }
  throw ArgumentError(name, " is ", wanted, " that was given back before; use it no more, and give it back once.");
}

bool HandleState::mark_returned(HandleKind kind, bool even_in_use, bool& is_in_use) {
  is_in_use = false;
  uint32_t expected = held(kind);
  for (;;) {
    if (word_.compare_exchange_weak(expected, expected | kGivenBack, std::memory_order_acq_rel)) return true;
    is_in_use = expected == (held(kind) | kInUse);
    if (expected == held(kind)) continue;
    if (!is_in_use || !even_in_use) return false;
  }
}

void HandleState::retire(void* memory, HandleKind kind) noexcept {
  if (memory == nullptr) return;
  ::new (memory) HandleState(kind, kGivenBack);
  void* oldest = memory;
  {
    std::lock_guard<std::mutex> lock(retired.mutex);
    std::swap(retired.memory[retired.next], oldest);
    retired.next = (retired.next + 1) % RetiredHandles::kKept;
  }
  ::operator delete(oldest);
}

}  // namespace maq
