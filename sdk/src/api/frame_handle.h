#pragma once

#include "api/handle.h"
#include "core/frame.h"
#include "maquette/frame.h"

// Frames of sources and results are whole handles from pools, so that lending one allocates nothing.
struct maq_frame : maq::HandleOf<maq::HandleKind::kFrame> {
  maq::Frame frame;
  maq_frame_release_callback release_callback = nullptr;
  void* user_data = nullptr;
  maq::BoundedPool<maq_frame>::Deleter deleter;  // empty: the app's own memory
};

namespace maq {

// Gives its pixels back at once, and the handle to its pool.
inline void return_to_pool(maq_frame* frame) {
  frame->frame.clear();
  std::exchange(frame->deleter, {})(frame);
}

}  // namespace maq
