#include "image/files/clip_writer.h"

#include <cmath>

#include "core/error.h"
#include "core/files/blocked_write_signals.h"
#include "core/files/file.h"
#include "core/files/file_reader.h"
#include "image/convert.h"

namespace maq {
namespace {

ClipFormat format_of(const std::string& path) {
  const std::string extension = lower_case_extension(path);
  if (extension == ".mp4") return ClipFormat::kMpeg4;
  if (extension == ".avi") return ClipFormat::kMotionJpeg;
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " ends neither in .mp4 nor in .avi, by which its format is chosen.");
}

const char* extension_of(ClipFormat format) { return format == ClipFormat::kMpeg4 ? ".mp4" : ".avi"; }

// MPEG-4 counts time in at most 65535 steps a second, and OpenCV makes them of three decimals of the rate.
double representable(double fps) {
  const double decimals = fps > 655.3 ? 10 : fps > 65.53 ? 100 : 1000;
  return std::round(fps * decimals) / decimals;
}

constexpr uint32_t four_characters(const char (&text)[5]) {
  return uint32_t(uint8_t(text[0])) | uint32_t(uint8_t(text[1])) << 8 | uint32_t(uint8_t(text[2])) << 16 |
         uint32_t(uint8_t(text[3])) << 24;
}

// Whether the boxes of an MP4 file (ISO/IEC 14496-12, 4.2) fill it, and its index, which is written last, is among
// them.
bool is_whole_mp4(FileReader& file) {
  bool has_index = false;
  while (file.remaining() >= 8) {
    uint64_t bytes = file.number<uint32_t>(ByteOrder::kBig);
    has_index |= file.number<uint32_t>() == four_characters("moov");
    uint64_t head_bytes = 8;
    if (bytes == 1 && file.remaining() >= 8) {
      bytes = file.number<uint64_t>(ByteOrder::kBig);
      head_bytes = 16;
    }
    if (bytes < head_bytes || bytes - head_bytes > file.remaining()) return false;
    file.skip(bytes - head_bytes);
  }
  return has_index && file.remaining() == 0;
}

// Whether the RIFF chunks of an AVI file fill it: their lengths are written last.
bool is_whole_avi(FileReader& file) {
  bool has_chunk = false;
  while (file.remaining() >= 8) {
    if (file.number<uint32_t>() != four_characters("RIFF")) return false;
    const uint64_t bytes = file.number<uint32_t>();
    if (bytes > file.remaining()) return false;
    file.skip(bytes);
    has_chunk = true;
  }
  return has_chunk && file.remaining() == 0;
}

// The encoder does not report a full disk, so the file is checked.
bool is_whole(const std::string& path, ClipFormat format) {
  FileReader file(path);
  return format == ClipFormat::kMpeg4 ? is_whole_mp4(file) : is_whole_avi(file);
}

}  // namespace

ClipWriter::ClipWriter(const std::string& path, double fps)
    : format_(format_of(path)), fps_(representable(fps)), file_(path, extension_of(format_)) {
  file_codecs();  // where it is missing, an error before the first image
}

ClipWriter::~ClipWriter() { end_encoding(); }

void ClipWriter::end_encoding() {
  const BlockedWriteSignals blocked;
  encoder_.reset();
}

void ClipWriter::begin(const ImageView& first) {
  // FFmpeg takes the text before a colon for a protocol, but not after a slash.
  const std::string& path = file_.temporary_path();
  const int width = first.width_px / 2 * 2, height = first.height_px / 2 * 2;
  encoder_ = file_codecs().begin_clip(path.front() == '/' ? path : "./" + path, format_, fps_, width, height);
  if (encoder_ == nullptr) {
    // Or is the disk full? Then this throws; the next encoder begins the file anew.
    constexpr char kProbe[4096] = {};
    file_.append(kProbe, sizeof kProbe);
    throw Error(MAQ_ERROR_UNSUPPORTED, file_.path(), ": this OpenCV does not write ",
                format_ == ClipFormat::kMpeg4 ? "MPEG-4" : "Motion JPEG", " of ", width, " x ", height,
                " pixels; try a name that ends in ", format_ == ClipFormat::kMpeg4 ? ".avi" : ".mp4",
                ", or a smaller image.");
  }
  width_px_ = first.width_px;
  height_px_ = first.height_px;
}

void ClipWriter::add(const ImageView& image) {
  if (is_finished_ || (images_ > 0 && encoder_ == nullptr)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, file_.path(), " is finished: nothing can be added.");
  }
  if (encoder_ != nullptr && (image.width_px != width_px_ || image.height_px != height_px_)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The image has ", image.width_px, " x ", image.height_px,
                " pixels, but the first of ", file_.path(), " has ", width_px_, " x ", height_px_,
                "; begin another clip.");
  }
  if (image.width_px < 2 || image.height_px < 2) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, "The image has ", image.width_px, " x ", image.height_px,
                " pixels, but a clip needs 2 x 2 at least.");
  }
  ImageView bgr = as_bgr(image, bgr_);
  bgr.width_px = image.width_px / 2 * 2;
  bgr.height_px = image.height_px / 2 * 2;
  const BlockedWriteSignals blocked;  // the encoder writes by itself
  if (encoder_ == nullptr) begin(image);
  if (!encoder_->write(bgr)) {
    throw Error(MAQ_ERROR_INTERNAL, "An image of ", file_.path(), " could not be encoded.");
  }
  ++images_;
}

void ClipWriter::finish() {
  if (is_finished_) return;
  if (images_ == 0) throw Error(MAQ_ERROR_INVALID_ARGUMENT, file_.path(), " has no image yet: add one.");
  end_encoding();
  if (!is_whole(file_.temporary_path(), format_)) {
    throw Error(MAQ_ERROR_UNWRITABLE, file_.path(), " cannot be written to its end: make room on the disk.");
  }
  file_.commit();
  is_finished_ = true;
}

}  // namespace maq
