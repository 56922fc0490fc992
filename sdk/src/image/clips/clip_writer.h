// Writes images to a video file that appears when it is complete.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/files/atomic_file.h"
#include "core/frame.h"
#include "image/clips/mp4_index.h"
#include "image/clips/vp9_encoder.h"

namespace maq {

constexpr double kMinClipFps = 0.01;
constexpr double kMaxClipFps = 1000;

class ClipWriter {
 public:
  // VP9 in an MP4 file; `fps` from kMinClipFps to kMaxClipFps, rounded to 0.001.
  // Throws MAQ_ERROR_INVALID_ARGUMENT for an extension other than .mp4, and the errors of AtomicFile.
  ClipWriter(const std::string& path, double fps);

  // All have the size of the first; of an odd side the last column or row is left out.
  // Throws MAQ_ERROR_INVALID_ARGUMENT for another size and after finish(), MAQ_ERROR_IMAGE_SIZE for less than 2 x 2
  // pixels, MAQ_ERROR_UNSUPPORTED for depth images and on Android, and MAQ_ERROR_UNWRITABLE when the disk is full.
  void add(const ImageView& image);

  // Throws MAQ_ERROR_INVALID_ARGUMENT when nothing was added, MAQ_ERROR_UNWRITABLE when the disk is full; then the
  // file that was there before stays. Does nothing the second time.
  void finish();

 private:
  void write_chunk();

  double fps_;
  int width_px_ = 0, height_px_ = 0;  // size of the first image
  bool is_finished_ = false;
  bool is_broken_ = false;  // an image is missing from the file
  std::vector<uint8_t> bgr_, chunk_;
  AtomicFile file_;
  std::optional<Vp9Encoder> encoder_;  // from the first image to the end
  std::optional<Mp4Index> index_;
};

}  // namespace maq
