#include "core/module.h"
#include "image/files/file_codecs.h"

namespace maq {

const FileCodecs& file_codecs() {
  // Tried again when it throws.
  static const auto* const codecs = static_cast<const FileCodecs*>(
      open_module("libmaquette_files.so", kFileCodecsSymbol, "Image and video files need",
                  "Install it and OpenCV's imgcodecs and videoio beside libmaquette.so."));
  return *codecs;
}

}  // namespace maq
