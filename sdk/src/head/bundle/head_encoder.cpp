#include "head/bundle/head_encoder.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/math/finite.h"
#include "nn/thread_choice.h"

namespace maq::head {
namespace {

constexpr float kGrey = 127;
constexpr double kMinSide_px = 2, kMaxSide_px = 1e5, kMaxPlace_px = 1e6;

Shape input_shape(const EncoderSpec& spec) { return {1, spec.crop_px(), spec.crop_px(), 3}; }
std::vector<Shape> output_shapes(const EncoderSpec& spec) {
  return {{1, spec.cells.side, spec.cells.side, int64_t(kCellChannels)}};
}

void check_numbers(const HeadSquare& square) {
  // False for NaN.
  if (std::abs(square.x_px) <= kMaxPlace_px && std::abs(square.y_px) <= kMaxPlace_px &&
      std::abs(square.roll_rad) <= 1e3 && square.side_px >= kMinSide_px && square.side_px <= kMaxSide_px) {
    return;
  }
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The square around a head has its middle at (", square.x_px, ", ",
              square.y_px, ") and sides of ", square.side_px, " pixels, turned by ", square.roll_rad,
              " rad. Give finite numbers, and sides of ", kMinSide_px, " to ", kMaxSide_px, " pixels.");
}

}  // namespace

HeadSquare square_around(double x0, double y0, double x1, double y1, double roll_rad, const EncoderSpec& spec) {
  const HeadSquare square{(x0 + x1) / 2, (y0 + y1) / 2, spec.crop_sides * std::max(x1 - x0, y1 - y0), roll_rad};
  if (!(x1 > x0 && y1 > y0)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The box of a head reaches from (", x0, ", ", y0, ") to (", x1, ", ", y1,
                "). Give a box with an area, the smaller numbers first.");
  }
  check_numbers(square);
  return square;
}

AffineMap crop_to_photo(const HeadSquare& square, int crop_px) {
  const double scale = square.side_px / crop_px;
  const double c = std::cos(square.roll_rad) * scale, s = std::sin(square.roll_rad) * scale;
  AffineMap map{c, -s, 0, s, c, 0};
  const Point middle = map({crop_px / 2.0, crop_px / 2.0});
  map.shift_x = square.x_px - middle.x;
  map.shift_y = square.y_px - middle.y;
  return map;
}

void check_square(const HeadSquare& square, int width_px, int height_px) {
  check_numbers(square);
  const double reach = square.side_px / 2 * (std::abs(std::cos(square.roll_rad)) + std::abs(std::sin(square.roll_rad)));
  if (square.x_px - reach < width_px && square.x_px + reach > 0 && square.y_px - reach < height_px &&
      square.y_px + reach > 0) {
    return;
  }
  throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The square around a head, with its middle at (", square.x_px, ", ",
              square.y_px, ") and sides of ", square.side_px, " pixels, shows nothing of the photo of ", width_px,
              " x ", height_px, ". Give a head's place in this photo.");
}

HeadEncoder::HeadEncoder(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const HeadBundle& bundle,
                         SessionSettings settings)
    : spec_(bundle.encoder), shapes_(output_shapes(spec_)) {
  const GraphSpec& graph = bundle.encoder_graph();
  const std::vector<uint8_t>& bytes = bundle.bundle.files.at(graph.file);
  const std::string name = bundle.bundle.path_of(graph.file);
  if (settings.threads == MAQ_THREADS_MEASURED) {
    const TimedNetwork timed{bytes, graph, name, spec_.crop_px(), spec_.crop_px(), input_shape(spec_), shapes_};
    settings.threads = measure_threads(runtime, timed, settings);
  }
  threads_ = settings.threads;
  session_ = open_session(std::move(runtime), bytes, graph, name, settings);
}

void HeadEncoder::run(const ImageView& photo, const HeadSquare& square, const RunCancel& cancel,
                      HeadEncoding& encoding) {
  check_square(square, photo.width_px, photo.height_px);
  const int crop_px = spec_.crop_px();
  encoding.crop_to_photo = crop_to_photo(square, crop_px);
  // Zero is grey, the value beyond the photo.
  NetworkInputSpec as_bytes;
  as_bytes.mean = {kGrey, kGrey, kGrey};
  as_bytes.std = {1, 1, 1};
  make_crop_input(photo, encoding.crop_to_photo, {crop_px, crop_px}, as_bytes, crop_);
  const size_t pixels = size_t(crop_px) * size_t(crop_px);
  encoding.rgb.resize(3 * pixels);
  for (size_t i = 0; i < pixels; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      encoding.rgb[3 * i + c] = std::clamp(crop_.values[c * pixels + i] + kGrey, 0.0f, 255.0f);
    }
  }

  inputs_.assign(1, {encoding.rgb.data(), input_shape(spec_)});
  const float* const found = session_->run(inputs_, shapes_, &cancel)[0].data;
  const size_t cells = size_t(spec_.cells.side) * size_t(spec_.cells.side);
  encoding.cells.assign(found, found + cells * kCellChannels);
  encoding.broken_cells = 0;
  for (size_t i = 0; i < cells; ++i) {
    const float* const cell = encoding.cells.data() + i * kCellChannels;
    if (!are_finite(cell, kCellChannels)) ++encoding.broken_cells;
  }
  if (encoding.broken_cells == cells) {
    throw Error(MAQ_ERROR_INFERENCE, "The encoder of heads gave no finite number. Install the bundle again.");
  }
}

}  // namespace maq::head
