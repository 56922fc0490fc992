// Hardware buffers (AHardwareBuffer) as frames, and as pictures to draw on, without copies where the CPU can have them.
#pragma once

#include <memory>

#include "graphics/ndk_graphics.h"
#include "maquette/maquette.h"

namespace maq_jni {

// The frame of a buffer's pixels; of `like` the time, clock and number are taken, and of a YUV buffer the range and
// rotation too. RGBA, RGBX and RGB, and YUV that is NV12 in video range already and not rotated, stay where they are:
// the buffer is locked for reading and kept until the frame has been released. Other YUV is copied. Throws
// MAQ_ERROR_INVALID_ARGUMENT for a buffer that the CPU may not read, MAQ_ERROR_UNSUPPORTED for a protected one and for
// other formats, MAQ_ERROR_UNREADABLE where Android gives no memory or strides that cannot be.
maq_frame* frame_of(const GraphicsFunctions& android, AHardwareBuffer* buffer, maq_context* context,
                    const maq_yuv_image& like);

// Memory that gets RGBA rows.
struct Canvas {
  int width_px, height_px;
  uint8_t* rgba;
  size_t stride_bytes;
  size_t size_bytes;
};

// Locks the buffer for writing while `draw` runs, which gets `self`. Throws as frame_of(), and what `draw` throws.
void draw_on(const GraphicsFunctions& android, AHardwareBuffer* buffer, void (*draw)(void* self, const Canvas&),
             void* self);

// Not std::function, whose exception a library would export.
template <typename Draw>
void draw_on(const GraphicsFunctions& android, AHardwareBuffer* buffer, const Draw& draw) {
  draw_on(
      android, buffer, [](void* self, const Canvas& canvas) { (*static_cast<const Draw*>(self))(canvas); },
      const_cast<void*>(static_cast<const void*>(std::addressof(draw))));
}

}  // namespace maq_jni
