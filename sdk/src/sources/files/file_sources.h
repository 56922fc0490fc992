// Sources that read image and video files.
#pragma once

#include <memory>

#include "sources/source.h"
#include "sources/uri.h"

namespace maq {

// One frame, the image. Throws the errors of read_image_file.
std::unique_ptr<Source> open_image_source(SourceUri uri);

// The frames of a clip at their presentation times. Throws the errors of open_file(), MAQ_ERROR_UNREADABLE
// and MAQ_ERROR_IMAGE_SIZE; next() throws MAQ_ERROR_UNREADABLE when the clip ends before its header says.
std::unique_ptr<Source> open_video_source(SourceUri uri);

// Returns the scheme for a file: "image", "video" or "rec", by its first bytes, else by its extension. A file that is
// missing, unreadable or not regular is an "image": opening it gives the error, and images may come from
// pipes. Throws MAQ_ERROR_INVALID_ARGUMENT for a folder.
const char* scheme_of_file(const std::string& path);

}  // namespace maq
