// Sources that read image and video files, and recordings.
#pragma once

#include <memory>

#include "sources/source.h"
#include "sources/uri.h"

namespace maq {

// One frame, the image. Throws what read_image_file throws.
std::unique_ptr<Source> open_image_source(SourceUri uri);

// The frames of a clip at their presentation times. Throws MAQ_ERROR_NOT_FOUND, MAQ_ERROR_UNREADABLE,
// MAQ_ERROR_IMAGE_SIZE; next() throws MAQ_ERROR_UNREADABLE when the clip ends before its header says.
std::unique_ptr<Source> open_video_source(SourceUri uri);

// The frames of a recording at their times, from `from` to `to` seconds; they are gone to by seek(). next() throws
// MAQ_ERROR_UNREADABLE for a damaged frame, and goes on after it. Throws what RecordingReader throws.
std::unique_ptr<Source> open_recording_source(SourceUri uri, const Log& log);

}  // namespace maq
