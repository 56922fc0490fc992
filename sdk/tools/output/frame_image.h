// Between frames of the SDK and images that the programs draw on.
#pragma once

#include <maquette/maquette.hpp>

#include "output/canvas.h"

// A copy.
Canvas image_of(const maquette::Frame& frame);

// Wraps the image's memory, which must stay until the frame is gone.
maquette::Frame frame_of(const maquette::Context& context, const Canvas& image);
// The colours of a rendered image.
maquette::Frame frame_of(const maquette::Context& context, const maquette::Image& image);
