// Which of libcamera's formats this build understands, and the choice among a camera's formats.
#pragma once

#include <libcamera/camera.h>
#include <libcamera/pixel_format.h>

#include <memory>
#include <string>
#include <vector>

#include "sources/camera_backend.h"

namespace maq {

// The camera may be acquired or not. Throws MAQ_ERROR_UNSUPPORTED for a camera that offers no images; `label`
// ("libcamera:0") begins the sentence.
std::unique_ptr<libcamera::CameraConfiguration> libcamera_configuration(libcamera::Camera& camera,
                                                                        const std::string& label);

// Every format and size of the camera.
std::vector<CameraMode> libcamera_modes(const libcamera::CameraConfiguration& configuration);

// Makes the configuration the nearest to the request: of all formats that both sides know, the one nearest in size,
// then the cheapest to use. Throws MAQ_ERROR_UNSUPPORTED.
void choose_libcamera_format(libcamera::CameraConfiguration& configuration, const CameraRequest& request, int buffers,
                             const std::string& label);

// The validated configuration of the camera, and the bytes of a line.
struct LibcameraFormat {
  CameraFormat format;
  size_t stride_bytes = 0;
};
LibcameraFormat agreed_libcamera_format(const libcamera::StreamConfiguration& agreed, const std::string& label);

}  // namespace maq
