// Sources that read image and video files.
#pragma once

#include <memory>

#include "sources/source.h"
#include "sources/uri.h"

namespace maq {

// One frame, the image. Throws what read_image_file throws.
std::unique_ptr<Source> open_image_source(SourceUri uri);

// The frames of a clip at their presentation times. Throws what open_file() throws, MAQ_ERROR_UNREADABLE
// and MAQ_ERROR_IMAGE_SIZE; next() throws MAQ_ERROR_UNREADABLE when the clip ends before its header says.
std::unique_ptr<Source> open_video_source(SourceUri uri);

// The scheme for a file: "image", "video" or "rec", by how the file begins, else by its extension. What is
// missing, cannot be read or is no regular file is an "image": opening it says what is wrong, and images may come from
// pipes. Throws MAQ_ERROR_INVALID_ARGUMENT for a folder.
const char* scheme_of_file(const std::string& path);

}  // namespace maq
