// Which kinds of sources there are, and how a URI becomes one.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sources/camera_backend.h"
#include "sources/source.h"

namespace maq {

struct SourceScheme {
  const char* name;     // "v4l2"
  const char* example;  // "v4l2:/dev/video0?size=640x480&fps=30"
  const char* summary;
  bool is_camera = false;
};

// Every scheme of this build.
const std::vector<SourceScheme>& source_schemes();

// The cameras that are connected now.
std::vector<CameraListing> list_cameras();

// A URI, or the path of a file or a camera (/dev/video0): in a path every character is part of the name. Throws
// MAQ_ERROR_UNSUPPORTED for a scheme that is not in the list, and the errors of the source.
std::unique_ptr<Source> open_source(const std::string& uri, const SourceSettings& settings = {});

}  // namespace maq
