// Exposure, gain, focus, white balance and brightness of a camera by Video4Linux2.
#pragma once

#include "maquette/source.h"
#include "sources/v4l2/v4l2_device.h"

namespace maq {

// Like Camera::control and Camera::set_control, with the same errors. From any thread.
maq_source_control_info read_v4l2_control(const V4l2Device& device, maq_source_control which);
void write_v4l2_control(const V4l2Device& device, maq_source_control which, double value);

}  // namespace maq
