#include "sources/depthai/depthai_inbox.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "core/clock.h"
#include "core/frame.h"

namespace maq {
namespace {

constexpr size_t kMaxStrideRows = 16;  // a longer stride, in rows of pixels, is an error of the device

// Whether the frame has the bytes that it claims to have. Its size is one that is allowed.
bool has_its_bytes(const DepthAiFrame& frame) {
  const maq_pixel_format format = *frame.format;
  const int width_px = int(frame.width_px), height_px = int(frame.height_px);
  const size_t row = row_bytes(format, 0, width_px);
  if (frame.data == nullptr || frame.stride_bytes < row || frame.stride_bytes > kMaxStrideRows * row) return false;
  // The padding behind the last row may be missing.
  const auto plane_bytes = [&](int plane) {
    return bytes_of_rows(frame.stride_bytes, plane_rows(format, plane, height_px), row_bytes(format, plane, width_px))
        .value_or(SIZE_MAX);
  };
  if (plane_bytes(0) > frame.size_bytes) return false;
  if (plane_count(format) == 1) return true;
  return frame.stride_bytes >= row_bytes(format, 1, width_px) && frame.uv_offset_bytes >= plane_bytes(0) &&
         frame.uv_offset_bytes <= frame.size_bytes && plane_bytes(1) <= frame.size_bytes - frame.uv_offset_bytes;
}

bool is_usable_colour(const DepthAiFrame& frame, const DepthAiPlan& plan) {
  return frame.format && *frame.format != MAQ_PIXEL_DEPTH16 && frame.width_px == plan.width_px &&
         frame.height_px == plan.height_px && has_its_bytes(frame);
}

// Checks for the image's shape, and at most its size: then depth fits pixel by pixel, or is a smaller version.
bool is_usable_depth(const DepthAiFrame& frame, const DepthAiPlan& plan) {
  if (!plan.with_depth || frame.format != MAQ_PIXEL_DEPTH16) return false;
  if (frame.width_px < 1 || frame.width_px > plan.width_px) return false;
  if (frame.height_px < 1 || frame.height_px > plan.height_px) return false;
  const int64_t skew = std::abs(frame.width_px * plan.height_px - frame.height_px * plan.width_px);
  if (skew >= std::max(plan.width_px, plan.height_px)) return false;
  // It is read as uint16_t.
  return has_its_bytes(frame) && reinterpret_cast<uintptr_t>(frame.data) % 2 == 0 && frame.stride_bytes % 2 == 0;
}

}  // namespace

void DepthAiInbox::receive_colour(DepthAiFrame frame) noexcept {
  if (is_usable_colour(frame, plan_)) add(true, std::move(frame));
}

void DepthAiInbox::receive_depth(DepthAiFrame frame) noexcept {
  if (is_usable_depth(frame, plan_)) add(false, std::move(frame));
}

std::optional<DepthAiPair> DepthAiInbox::next(int64_t now_ns) {
  std::lock_guard<std::mutex> lock(mutex_);
  return pairing_.next(now_ns);
}

int64_t DepthAiInbox::due_ns() {
  std::lock_guard<std::mutex> lock(mutex_);
  return pairing_.due_ns();
}

void DepthAiInbox::close() {
  std::lock_guard<std::mutex> lock(mutex_);
  open_ = false;
  pairing_.clear();
}

void DepthAiInbox::add(bool is_colour, DepthAiFrame frame) noexcept {
  try {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!open_) return;
    if (is_colour) {
      pairing_.add_colour(std::move(frame), monotonic_ns());
    } else {
      pairing_.add_depth(std::move(frame), monotonic_ns());
    }
  } catch (const std::exception&) {
    return;  // no memory: the frame is lost
  }
  event_.signal();
}

}  // namespace maq
