#include "edges/edges.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "core/rounding.h"
#include "image/depth.h"
#include "nn/provider.h"

namespace maq {
namespace {

constexpr int kDepthRowsOfTask = 32;

SessionSettings session_settings(const OnnxRuntimeLibrary& runtime, const EdgesSettings& settings) {
  SessionSettings made;
  made.threads = settings.threads;
  made.provider = available_provider(runtime, settings.provider);
  return made;
}

void check_input(const ImageView& depth, const Intrinsics& intrinsics) {
  if (!is_depth(depth.format)) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The frame is an image (", pixel_format_name(depth.format),
                ") without depth, but edges need depth frames (DEPTH16, DEPTH32F). For an image file with depth, add "
                "its unit: image:depth.png?depth_unit=0.001&fov=60.");
  }
  if (intrinsics.width_px != depth.width_px || intrinsics.height_px != depth.height_px) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The intrinsics are for a camera of ", intrinsics.width_px, " x ",
                intrinsics.height_px, " pixels, but the depth frame has ", depth.width_px, " x ", depth.height_px,
                "; scale them to its size.");
  }
  const auto require_focal = [](const char* name, double value) {
    if (!(value >= 1e-3 && value <= 1e9)) {
      throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The focal length ", name, " of the intrinsics is ", value,
                  ", but must be 0.001 to 1e9 pixels; for a field of view of 60 degrees it is 0.87 times the width.");
    }
  };
  require_focal("fx_px", intrinsics.fx_px);
  require_focal("fy_px", intrinsics.fy_px);
  if (!std::isfinite(intrinsics.cx_px) || !std::isfinite(intrinsics.cy_px)) {
    throw Error(MAQ_ERROR_INVALID_ARGUMENT, "The principal point of the intrinsics is (", intrinsics.cx_px, ", ",
                intrinsics.cy_px, "), which is not finite.");
  }
}

}  // namespace

Edges::Edges(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle, const EdgesSettings& settings)
    : skips_planes_(settings.skips_planes),
      measures_threads_(settings.threads == MAQ_THREADS_MEASURED),
      network_(runtime, std::move(bundle), session_settings(*runtime, settings)),
      cancel_(runtime),
      threads_(network_.threads()),
      average_(settings.average_frames) {}

void Edges::run(const ImageView& depth, const Intrinsics& intrinsics, EdgesResult& result) {
  check_input(depth, intrinsics);
  EdgeField& field = result.field;
  field.width = depth.width_px;
  field.height = depth.height_px;
  field.intrinsics = intrinsics;
  field.eps_r = network_.eps_r();
  result.stats = {};
  try {
    cancel_.check();
    find_field(depth, result);
    cancel_.check();  // a later request cancels the next run
  } catch (...) {
    cancel_.reset();
    throw;
  }
}

void Edges::run(const Frame& frame, EdgesResult& result) {
  const ImageView* const depth = depth_of(frame);
  const ImageView& image = depth == nullptr ? frame.image : *depth;  // check_input refuses an image without depth
  const Intrinsics camera = intrinsics_of(frame.intrinsics);
  if (depth != nullptr && camera.width_px == 0 && camera.height_px == 0) {
    throw Error(MAQ_ERROR_UNSUPPORTED,
                "The frame does not carry the intrinsics of its camera, which edges need for lengths. Add fov=60 "
                "(degrees) or fx=380&fy=380 (pixels) to the URI of the source, or set desc.intrinsics for "
                "maq_frame_wrap.");
  }
  const bool is_of_image = camera.width_px == frame.image.width_px && camera.height_px == frame.image.height_px;
  run(image, is_of_image ? resized(camera, image.width_px, image.height_px) : camera, result);
}

void Edges::find_field(const ImageView& depth, EdgesResult& result) {
  EdgeField& field = result.field;
  EdgesStats& stats = result.stats;
  const int multiple = network_.multiple_px();
  if (int64_t(round_up(field.width, multiple)) * round_up(field.height, multiple) > kMaxPixels) {
    throw Error(MAQ_ERROR_IMAGE_SIZE, "The depth frame is ", field.width, " x ", field.height,
                " pixels, over the limit of ", kMaxPixels, " for the network; use a smaller one.");
  }
  const Stopwatch total;
  Stopwatch stage;
  const size_t pixels = size_t(field.width) * size_t(field.height);
  for (std::vector<float>* plane : {&field.distance_r, &field.expected_error_r, &field.depth_m}) plane->resize(pixels);
  field.kind.resize(pixels);
  threads_.run(size_t(divide_up(field.height, kDepthRowsOfTask)), [&](size_t task, int) {
    const int top = int(task) * kDepthRowsOfTask, rows = std::min(kDepthRowsOfTask, field.height - top);
    depth_in_metres(window_of(depth, 0, top, field.width, rows),
                    field.depth_m.data() + size_t(top) * size_t(field.width));
  });
  stats.averaged_pixels = average_.add(field.depth_m.data(), field.intrinsics, threads_);
  stats.known_pixels = std::count_if(field.depth_m.begin(), field.depth_m.end(), [](float z) { return z > 0; });
  stats.far_pixels = std::count_if(field.depth_m.begin(), field.depth_m.end(), [](float z) { return z > kFarDepthM; });
  stats.depth_ms = float(stage.lap_ms());

  const DepthPlane plane{field.depth_m.data(), field.width, field.height};
  const FieldWindow window = network_window(field, stats.known_pixels > 0);
  if (skips_planes_) stats.skip_ms = float(stage.lap_ms());
  clear_outside(window, field);
  if (window.width_px > 0) {
    slopes_.make(plane, field.intrinsics, window, threads_, network_.input(window.width_px, window.height_px));
    stats.slopes_ms = float(stage.lap_ms());
    const float* const planes = network_.run(window.width_px, window.height_px, cancel_);
    stats.network_pixels = int64_t(window.width_px) * window.height_px;
    stats.network_ms = float(stage.lap_ms());
    stats.broken_pixels = decode_.write(planes, window, threads_, field);
  }
  stats.decode_ms = float(stage.lap_ms());
  stats.provider = network_.provider();
  stats.threads = network_.threads();
  stats.is_threads_measured = measures_threads_;
  stats.total_ms = float(total.elapsed_ms());
}

// Returns the window in which the network must run.
FieldWindow Edges::network_window(const EdgeField& field, bool is_known) {
  if (!is_known) return {};
  const int multiple = network_.multiple_px();
  if (!skips_planes_) return {0, 0, round_up(field.width, multiple), round_up(field.height, multiple)};
  return active_.find({field.depth_m.data(), field.width, field.height}, field.intrinsics, multiple, threads_);
}

}  // namespace maq
