#include "core/module.h"
#include "image/file_decoders.h"

namespace maq {

const FileDecoders& file_decoders() {
  // Tried again when it throws.
  static const auto* const decoders = static_cast<const FileDecoders*>(
      open_module("libmaquette_files.so", kFileDecodersSymbol, "Image and video files need",
                  "Install it and OpenCV's imgcodecs and videoio beside libmaquette.so."));
  return *decoders;
}

}  // namespace maq
