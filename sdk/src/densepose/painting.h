// Images of a result: the people over their frame, each pixel in the colour of its body part.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/frame.h"
#include "densepose/surface/dense_decode.h"

namespace maq {

enum class PartColours { kDefault, kDetectron2, kMagicAnimate };  // see maq_densepose_colours

// As maq_densepose_drawing; the part of the frame is within it and has at least one pixel.
struct Painting {
  int x_px = 0, y_px = 0, width_px = 0, height_px = 0;
  int opacity = 255;
  bool is_mirrored = false;
  PartColours colours = PartColours::kDefault;
};

// Writes height_px rows of width_px RGBA pixels. `frame` has the size of `planes`, or is null: the background is
// transparent then, and colours are multiplied by their opacity. Throws MAQ_ERROR_UNSUPPORTED for a depth image.
void paint_people(const DensePlanes& planes, const ImageView* frame, const Painting& painting, uint8_t* rgba,
                  size_t stride_bytes);

}  // namespace maq
