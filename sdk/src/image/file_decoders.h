// What decodes image and video files: OpenCV's imgcodecs and videoio.
//
// They bring some two hundred shared libraries on Debian (GDAL and FFmpeg among them), 65 MB of memory and more than a
// tenth of a second, which an app with a camera does not need. So they are in a library of their own,
// libmaquette_files.so, which is opened when the first file is.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "image/orientation.h"

namespace maq {

// A clip that is open. Numbers are as its file says and may be anything.
class Clip {
 public:
  virtual ~Clip() = default;
  virtual int width_px() const = 0;
  virtual int height_px() const = 0;
  virtual double fps() const = 0;
  virtual double frame_count() const = 0;
  // The presentation time of the frame that read() gave last.
  virtual double position_ms() const = 0;
  // False after the last frame that can be decoded.
  virtual bool read(cv::Mat& image) = 0;
};

// No function of these throws: they are called across libraries.
class FileDecoders {
 public:
  virtual ~FileDecoders() = default;
  // BGR, 8 bits; empty for what is damaged or no image.
  virtual cv::Mat decode_image(const uint8_t* bytes, size_t size_bytes, Orientation orientation) const = 0;
  // Nothing for what is damaged or no video.
  virtual std::unique_ptr<Clip> open_clip(const std::string& path) const = 0;
};

// Opens libmaquette_files.so at the first call. Throws MAQ_ERROR_RUNTIME_LIBRARY where it is missing or of another
// build. Where the decoders are linked in (tests), it is those.
const FileDecoders& file_decoders();

// What the library exports, a FileDecoders (core/module.h).
constexpr char kFileDecodersSymbol[] = "maquette_file_decoders";

}  // namespace maq
