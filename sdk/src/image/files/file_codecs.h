// Decodes and encodes image and video files with libpng and OpenCV's imgcodecs and videoio, the only place of the
// library where OpenCV is. JPEG images are decoded without it (jpeg.h). Android brings decoders of its own (android/).
//
// They bring some two hundred shared libraries on Debian (GDAL and FFmpeg among them), 65 MB of memory and more than a
// tenth of a second, which an app with a camera does not need. So they are in a library of their own,
// libmaquette_files.so, which is opened when the first file is.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/frame.h"
#include "image/files/image_header.h"

namespace maq {

// An image that was decoded, and its memory. No width: nothing was decoded.
struct DecodedImage {
  ImageView view;
  std::shared_ptr<const void> memory;
};

// Reads a clip. Its numbers are as the file says, unchecked.
class ClipDecoder {
 public:
  virtual ~ClipDecoder() = default;
  virtual int width_px() const = 0;
  virtual int height_px() const = 0;
  virtual double fps() const = 0;
  virtual double frame_count() const = 0;
  // The presentation time of the frame that read() gave last; 0 where it is not known.
  virtual double position_ms() const = 0;
  // The number of that frame, from 0; after seek_ms() by the clip's mean rate.
  virtual double frame_number() const = 0;
  // Goes to a frame near that time, before or after it. False where this clip cannot.
  virtual bool seek_ms(double time_ms) = 0;
  // The next frame, BGR8 or GREY8, valid until the next call. False after the last that can be decoded. `image` has no
  // pixels if the frame's pixels are of another kind.
  virtual bool read(ImageView& image) = 0;
};

enum class ClipFormat { kMpeg4, kMotionJpeg };

// Writes a clip; its file is complete when this is destroyed. A full disk is not reported.
class ClipEncoder {
 public:
  virtual ~ClipEncoder() = default;
  // BGR8, of the size that begin_clip() was told. False where it cannot be encoded.
  virtual bool write(const ImageView& image) = 0;
};

// None of these functions throws (core/module.h has the rule): damage is told by an empty result. Those for depth do
// where there are none, which the library says itself.
class FileCodecs {
 public:
  virtual ~FileCodecs() = default;
  // A PNG, WebP, BMP or TIFF image, as it is stored, as BGR8; no width for a damaged image.
  virtual DecodedImage decode_image(const EncodedBytes& bytes, ImageFormat format) const = 0;
  // `extension`: ".png" or ".jpg"; the image is BGR8, GREY8 or, for PNG, RGBA8. False where it cannot be encoded.
  virtual bool encode_image(const std::string& extension, const ImageView& image,
                            std::vector<uint8_t>& bytes) const = 0;
  // A grey PNG or TIFF image of 16 bits as DEPTH16, a grey TIFF image of floats as DEPTH32F, whatever their unit; one
  // of other pixels has a size and no pixels, a damaged one no width.
  virtual DecodedImage decode_depth(const EncodedBytes&, ImageFormat) const { refuse_depth(); }
  // DEPTH16 as ".png", DEPTH32F as ".tiff". False where it cannot be encoded.
  virtual bool encode_depth(const std::string&, const ImageView&, std::vector<uint8_t>&) const { refuse_depth(); }
  // Null for a file that is damaged or not a video.
  virtual std::unique_ptr<ClipDecoder> open_clip(const std::string& path) const = 0;
  // `path` ends in .mp4 or .avi, like the format; sides are even. Null where this OpenCV does not write such clips.
  virtual std::unique_ptr<ClipEncoder> begin_clip(const std::string& path, ClipFormat format, double fps, int width_px,
                                                  int height_px) const = 0;

 private:
  [[noreturn]] static void refuse_depth() {
    throw Error(MAQ_ERROR_UNSUPPORTED, "This build has no codecs for files of depth; give depth as a frame.");
  }
};

// Opens libmaquette_files.so at the first call. Throws MAQ_ERROR_RUNTIME_LIBRARY where it is missing or of another
// build. Its codecs throw std::bad_alloc where they fail and there is too little memory. If the codecs are linked in
// (tests), returns them.
const FileCodecs& file_codecs();

// The export of the library, a FileCodecs (core/module.h).
constexpr char kFileCodecsSymbol[] = "maquette_file_codecs";

}  // namespace maq
