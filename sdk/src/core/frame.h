// A frame and the view of its pixels that the rest of the library works on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "maquette/frame.h"

namespace maq {

struct PlaneView {
  const uint8_t* data = nullptr;
  size_t stride_bytes = 0;
};

// A view of pixels in memory of another owner.
struct ImageView {
  maq_pixel_format format = MAQ_PIXEL_BGR8;
  int width_px = 0;
  int height_px = 0;
  PlaneView planes[2];
};

// The owner of pixels that a frame only borrows: a camera, of its buffers.
class FrameOwner {
 public:
  virtual ~FrameOwner() = default;
  // Returns a buffer. From any thread, once for each time it was lent.
  virtual void give_back(int slot) = 0;
  // The buffer as a dma-buf, which stays the owner's; -1 when there is none. From any thread, for a held buffer.
  virtual int dma_buf(int) { return -1; }
};

// Holds a buffer of an owner, and returns it.
class PixelLease {
 public:
  PixelLease() = default;
  PixelLease(std::shared_ptr<FrameOwner> owner, int slot) : owner_(std::move(owner)), slot_(slot) {}
  PixelLease(PixelLease&& other) noexcept : owner_(std::move(other.owner_)), slot_(other.slot_) {}
  PixelLease& operator=(PixelLease&& other) noexcept {
    if (this != &other) {
      reset();
      owner_ = std::move(other.owner_);
      slot_ = other.slot_;
    }
    return *this;
  }
  ~PixelLease() { reset(); }

  int dma_buf() const { return owner_ == nullptr ? -1 : owner_->dma_buf(slot_); }

  void reset() {
    if (owner_ != nullptr) owner_->give_back(slot_);
    owner_.reset();
  }

 private:
  std::shared_ptr<FrameOwner> owner_;
  int slot_ = 0;
};

// The captured frame behind a predicted frame (maq_frame_origin).
struct FrameOrigin {
  bool is_predicted = false;
  int64_t captured_timestamp_ns = 0;
  uint64_t captured_sequence = 0;
  int64_t horizon_ns = 0;

  // Returns the origin for the frame with another time and number.
  FrameOrigin moved_to(int64_t timestamp_ns, uint64_t sequence) const {
    return is_predicted ? FrameOrigin{true, timestamp_ns - horizon_ns, sequence, horizon_ns} : FrameOrigin{};
  }
};

struct Frame {
  ImageView image;
  ImageView depth{MAQ_PIXEL_DEPTH16, 0, 0, {}};  // aligned with the image; no width when there is none
  int64_t timestamp_ns = 0;
  maq_clock clock = MAQ_CLOCK_MEDIA;
  uint64_t sequence = 0;
  maq_intrinsics intrinsics{};  // camera of the image; width_px 0: unknown
  FrameOrigin origin;
  // Memory of the pixels when the library owns them; kept between uses of a pooled frame.
  std::vector<uint8_t> storage;
  std::vector<uint8_t> depth_storage;
  // The JPEG image that `image` was decoded from, in the camera's memory; null when it was not a JPEG image.
  const uint8_t* jpeg = nullptr;
  size_t jpeg_bytes = 0;
  // The lease of a camera's buffer; empty for pixels in memory of the frame or of an app.
  PixelLease lease;

  // Keeps the memory of the frame itself, for the next image.
  void clear() {
    lease.reset();
    jpeg = nullptr;
    depth.width_px = 0;
    intrinsics = {};
    origin = {};
  }

  // Makes `storage` hold one image of that size without row padding and points `image` at it.
  uint8_t* allocate(maq_pixel_format format, int width_px, int height_px);
  uint8_t* allocate_bgr(int width_px, int height_px) { return allocate(MAQ_PIXEL_BGR8, width_px, height_px); }
};

const char* pixel_format_name(maq_pixel_format format);
int plane_count(maq_pixel_format format);
inline bool is_depth(maq_pixel_format format) { return format == MAQ_PIXEL_DEPTH16 || format == MAQ_PIXEL_DEPTH32F; }
// Returns the depth image: the pixels of a depth frame, or the depth that came with a colour frame; null without depth.
inline const ImageView* depth_of(const Frame& frame) {
  if (is_depth(frame.image.format)) return &frame.image;
  return frame.depth.width_px > 0 ? &frame.depth : nullptr;
}
// Bytes of pixels in a row of plane `plane`, without padding.
size_t row_bytes(maq_pixel_format format, int plane, int width_px);
int plane_rows(maq_pixel_format format, int plane, int height_px);

// From the first row's beginning to the last row's end: the padding behind it need not be there. Nothing where it is
// more than an array can have. `rows` is at least 1.
std::optional<size_t> bytes_of_rows(size_t stride_bytes, int rows, size_t row_bytes);

// For an image without padding between its rows and planes.
size_t packed_bytes(maq_pixel_format format, int width_px, int height_px);
ImageView packed_view(maq_pixel_format format, int width_px, int height_px, const uint8_t* pixels);
void copy_packed(const ImageView& image, uint8_t* pixels);
// A part of an image, in its memory. `x` and `y` must be even: of YUV images two pixels share their colour.
ImageView window_of(const ImageView& image, int x, int y, int width_px, int height_px);

// Throws MAQ_ERROR_IMAGE_SIZE unless 1 <= side <= MAQ_MAX_SIDE_PX and the area is at most MAQ_MAX_PIXELS.
// `what` begins the sentence: "photo.jpg" or "The frame".
void check_image_size(int64_t width_px, int64_t height_px, const std::string& what);

// Throws for the description of an unreadable image; fills in strides that are 0.
ImageView checked_image_view(const maq_frame_desc& desc);

}  // namespace maq
