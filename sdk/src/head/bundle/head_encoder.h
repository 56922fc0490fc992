// The encoder of a bundle: converts a square of a photo to an estimate for each of its cells.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "head/bundle/head_bundle.h"
#include "image/crop_input.h"
#include "nn/session.h"

namespace maq::head {

// A square of a photo, in continuous coordinates: pixel (x, y) covers [x, x + 1) x [y, y + 1).
struct HeadSquare {
  double x_px = 0, y_px = 0;  // its middle
  double side_px = 0;
  double roll_rad = 0;  // rotation of the head in the image, clockwise; its crop is upright
};

// The square that the encoder wants to see of a head whose box, hair included, reaches from (x0, y0) to (x1, y1).
// Throws as check_square() does.
HeadSquare square_around(double x0, double y0, double x1, double y1, double roll_rad, const EncoderSpec& spec);

// From a crop of `crop_px` a side to its position in the photo, in continuous coordinates.
AffineMap crop_to_photo(const HeadSquare& square, int crop_px);

// Throws MAQ_ERROR_INVALID_ARGUMENT, with the remedy, for numbers that are not finite, sides under 2 or over 1e5
// pixels, and a square that shows nothing of a photo of that size.
void check_square(const HeadSquare& square, int width_px, int height_px);

struct HeadEncoding {
  std::vector<float> rgb;    // [crop_px][crop_px][3]: R, G, B in 0..255, the encoder's input; 127 beyond the photo
  std::vector<float> cells;  // [side][side][kCellChannels], as read_observations() reads them
  AffineMap crop_to_photo;
  size_t broken_cells = 0;  // with numbers that are not finite
};

class HeadEncoder {
 public:
  // `settings.threads` may be MAQ_THREADS_MEASURED. The bundle is not needed afterwards. Throws the errors of Session.
  HeadEncoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const HeadBundle& bundle, SessionSettings settings);
  HeadEncoder(const HeadEncoder&) = delete;
  HeadEncoder& operator=(const HeadEncoder&) = delete;

  const EncoderSpec& spec() const { return spec_; }
  int threads() const { return threads_; }  // in use
  maq_provider provider() const { return session_->provider(); }

  // Encodes a photo in any format except depth. The crop is interpolated bilinearly, from averaged pixels where it is
  // coarser than the photo. Memory of `encoding` is reused. Not for two threads at once. Throws as check_square() does,
  // MAQ_ERROR_UNSUPPORTED for depth, MAQ_ERROR_INFERENCE (also if no cell has finite numbers), MAQ_CANCELLED.
  void run(const ImageView& photo, const HeadSquare& square, const RunCancel& cancel, HeadEncoding& encoding);

 private:
  EncoderSpec spec_;
  std::vector<Shape> shapes_;  // of the outputs
  int threads_ = 1;
  std::unique_ptr<Session> session_;
  CropInput crop_;
  std::vector<TensorView> inputs_;
};

}  // namespace maq::head
