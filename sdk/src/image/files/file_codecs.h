// What decodes and encodes image and video files: OpenCV's imgcodecs and videoio.
//
// They bring some two hundred shared libraries on Debian (GDAL and FFmpeg among them), 65 MB of memory and more than a
// tenth of a second, which an app with a camera does not need. So they are in a library of their own,
// libmaquette_files.so, which is opened when the first file is.
#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "image/files/orientation.h"

namespace maq {

// A clip that is read. Numbers are as its file says and may be anything.
class ClipDecoder {
 public:
  virtual ~ClipDecoder() = default;
  virtual int width_px() const = 0;
  virtual int height_px() const = 0;
  virtual double fps() const = 0;
  virtual double frame_count() const = 0;
  // The presentation time of the frame that read() gave last.
  virtual double position_ms() const = 0;
  // False after the last frame that can be decoded.
  virtual bool read(cv::Mat& image) = 0;
};

enum class ClipFormat { kMpeg4, kMotionJpeg };

// A clip that is written; its file is complete when this is gone. Nobody tells whether the disk took it all.
class ClipEncoder {
 public:
  virtual ~ClipEncoder() = default;
  // BGR, of the size that begin_clip() was told. False where it cannot be encoded.
  virtual bool write(const cv::Mat& image) = 0;
};

// No function of these throws: they are called across libraries.
class FileCodecs {
 public:
  virtual ~FileCodecs() = default;
  // BGR, 8 bits; empty for what is damaged or no image.
  virtual cv::Mat decode_image(const uint8_t* bytes, size_t size_bytes, Orientation orientation) const = 0;
  // `ending`: ".png" or ".jpg"; the image is BGR or grey, of 8 bits. False where it cannot be encoded.
  virtual bool encode_image(const std::string& ending, const cv::Mat& image, std::vector<uint8_t>& bytes) const = 0;
  // Nothing for what is damaged or no video.
  virtual std::unique_ptr<ClipDecoder> open_clip(const std::string& path) const = 0;
  // `path` ends in .mp4 or .avi, like the format; sides are even. Nothing where this OpenCV does not write such clips.
  virtual std::unique_ptr<ClipEncoder> begin_clip(const std::string& path, ClipFormat format, double fps,
                                                  cv::Size size) const = 0;
};

// Opens libmaquette_files.so at the first call. Throws MAQ_ERROR_RUNTIME_LIBRARY where it is missing or of another
// build. Where the codecs are linked in (tests), it is those.
const FileCodecs& file_codecs();

// What the library exports, a FileCodecs (core/module.h).
constexpr char kFileCodecsSymbol[] = "maquette_file_codecs";

}  // namespace maq
