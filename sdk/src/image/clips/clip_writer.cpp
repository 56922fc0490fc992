#include "image/clips/clip_writer.h"

#include <cmath>

#include "core/error.h"
#include "core/files/file.h"
#include "image/convert.h"

namespace maq {
namespace {

constexpr size_t kChunkBytes = 1 << 20;

std::string checked(const std::string& path) {
  if (lower_case_extension(path) != ".mp4") {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, path, " does not end in .mp4, the format of clips.");
  }
  return path;
}

}  // namespace

ClipWriter::ClipWriter(const std::string& path, double fps)
    : fps_(std::round(fps * 1000) / 1000), file_(checked(path)) {}

void ClipWriter::add(const ImageView& image) {
  if (is_finished_) throw Error(MAQ_ERROR_INVALID_ARGUMENT, file_.path(), " is finished: nothing can be added.");
  if (encoder_ && (image.width_px != width_px_ || image.height_px != height_px_)) {
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
  const bool was_broken = std::exchange(is_broken_, true);
  if (!encoder_) {
    index_.emplace(bgr.width_px, bgr.height_px, fps_);
    encoder_.emplace(bgr.width_px, bgr.height_px);
    width_px_ = image.width_px;
    height_px_ = image.height_px;
    const std::vector<uint8_t> head = Mp4Index::file_head();
    file_.append(head.data(), head.size());
  }
  const Vp9Encoder::Packet packet = encoder_->encode(bgr);
  chunk_.insert(chunk_.end(), packet.bytes, packet.bytes + packet.size);
  index_->add_frame(packet.size, packet.is_key);
  if (chunk_.size() >= kChunkBytes) write_chunk();
  is_broken_ = was_broken;
}

void ClipWriter::write_chunk() {
  if (chunk_.empty()) return;
  const std::vector<uint8_t> head = Mp4Index::chunk_head(chunk_.size());
  file_.append(head.data(), head.size());
  index_->end_chunk(file_.size_bytes());
  file_.append(chunk_.data(), chunk_.size());
  chunk_.clear();
}

void ClipWriter::finish() {
  if (is_finished_) return;
  if (is_broken_) {
    throw Error(MAQ_ERROR_UNWRITABLE, file_.path(),
                " lacks an image, which could not be written; begin the clip anew.");
  }
  if (!encoder_) throw Error(MAQ_ERROR_INVALID_ARGUMENT, file_.path(), " has no image yet: add one.");
  is_broken_ = true;
  write_chunk();
  const std::vector<uint8_t> index = index_->index();
  file_.append(index.data(), index.size());
  file_.commit();
  encoder_.reset();
  is_finished_ = true;
}

}  // namespace maq
