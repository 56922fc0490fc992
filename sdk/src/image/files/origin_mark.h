// The mark of predicted frames in image files: a comment (JPEG) or a text chunk (PNG) at the beginning, with the
// content of maq_frame_get_origin.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/frame.h"
#include "image/files/image_header.h"

namespace maq {

// Puts the mark of a predicted frame into an encoded PNG or JPEG image; nothing for others. `extension`: ".png" or
// ".jpg".
void mark_origin(const FrameOrigin& origin, const std::string& extension, std::vector<uint8_t>& encoded);

// Reads the mark of an encoded image. An image without a mark was captured.
FrameOrigin read_origin_mark(const EncodedBytes& encoded);

}  // namespace maq
