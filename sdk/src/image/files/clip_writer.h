// Writes images to a video file that appears when it is complete.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/files/atomic_file.h"
#include "core/frame.h"
#include "image/files/file_codecs.h"

namespace maq {

constexpr double kMinClipFps = 0.01;
constexpr double kMaxClipFps = 1000;

class ClipWriter {
 public:
  // MPEG-4 in .mp4 or Motion JPEG in .avi, by the extension of `path`; `fps` from kMinClipFps to kMaxClipFps.
  // Throws MAQ_ERROR_INVALID_ARGUMENT for another extension, and the errors of AtomicFile and file_codecs().
  ClipWriter(const std::string& path, double fps);
  ~ClipWriter();

  // All have the size of the first; of an odd side the last column or row is left out.
  // Throws MAQ_ERROR_INVALID_ARGUMENT for another size and after finish(), MAQ_ERROR_IMAGE_SIZE for less than 2 x 2
  // pixels, MAQ_ERROR_UNSUPPORTED for depth images and, at the first, where this OpenCV does not write such clips, and
  // MAQ_ERROR_UNWRITABLE, at the first, when the disk is full already.
  void add(const ImageView& image);

  // Throws MAQ_ERROR_INVALID_ARGUMENT when nothing was added, MAQ_ERROR_UNWRITABLE when the disk is full; then the
  // file that was there before stays. Does nothing the second time.
  void finish();

 private:
  void begin(const ImageView& first);
  void end_encoding();

  ClipFormat format_;
  double fps_;
  int width_px_ = 0, height_px_ = 0;  // size of the first image
  uint64_t images_ = 0;
  bool is_finished_ = false;
  std::vector<uint8_t> bgr_;
  AtomicFile file_;
  std::unique_ptr<ClipEncoder> encoder_;  // destroyed before the file
};

}  // namespace maq
