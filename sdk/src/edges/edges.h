// The distance-to-feature field of depth frames: slopes, network, decode (DEF, arXiv 2011.15081).
#pragma once

#include <cstdint>
#include <memory>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "edges/active_window.h"
#include "edges/depth_average.h"
#include "edges/edge_field.h"
#include "edges/edge_network.h"
#include "edges/field_decode.h"

namespace maq {

// The settings of maq_edges_config, which explains them.
struct EdgesSettings {
  int threads = 1;  // or MAQ_THREADS_MEASURED
  maq_provider provider = MAQ_PROVIDER_CPU;
  bool skips_planes = false;
  int average_frames = 1;
};

inline constexpr float kFarDepthM = 50;  // few cameras see farther: depth beyond it is mostly of a wrong unit

struct EdgesStats {
  float depth_ms = 0;   // convert depth to metres, and average it with earlier frames
  float skip_ms = 0;    // find the window for the network
  float slopes_ms = 0;  // compute the network's input
  float network_ms = 0;
  float decode_ms = 0;
  float total_ms = 0;
  int64_t known_pixels = 0;
  int64_t network_pixels = 0;   // pixels the network ran on
  int64_t broken_pixels = 0;    // pixels with NaN from the network
  int64_t averaged_pixels = 0;  // pixels whose depth is the mean of several frames
  int64_t far_pixels = 0;       // pixels beyond kFarDepthM
  maq_provider provider = MAQ_PROVIDER_CPU;
  int threads = 1;
  bool is_threads_measured = false;
};

struct EdgesResult {
  EdgeField field;
  EdgesStats stats;
};

class Edges {
 public:
  // Limit for one frame with the padding for the network, which takes about 300 bytes a pixel.
  static constexpr int64_t kMaxPixels = int64_t(1) << 23;

  // Throws the errors of EdgeNetwork.
  Edges(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle, const EdgesSettings& settings);
  Edges(const Edges&) = delete;
  Edges& operator=(const Edges&) = delete;

  // Computes the field of a depth image; `intrinsics` must have its size. Reuses the memory of `result`. One thread at
  // a time. Throws MAQ_ERROR_UNSUPPORTED for an image without depth, MAQ_ERROR_INVALID_ARGUMENT for intrinsics of
  // another size, with values that are not finite or a focal length that is not positive; MAQ_ERROR_IMAGE_SIZE,
  // MAQ_ERROR_BAD_BUNDLE, MAQ_ERROR_INFERENCE, MAQ_CANCELLED.
  void run(const ImageView& depth, const Intrinsics& intrinsics, EdgesResult& result);
  // Computes the field of a depth frame, or of the depth that came with a colour frame. Uses the frame's intrinsics.
  // These may be the colour image's, which shows the same view. Ignores distortion. Throws MAQ_ERROR_UNSUPPORTED for a
  // frame without intrinsics.
  void run(const Frame& frame, EdgesResult& result);
  // Returns the number of threads in use.
  int threads() const { return network_.threads(); }
  // Cancels the running call, or else the next. From any thread.
  void cancel() noexcept { cancel_.cancel(); }

 private:
  void find_field(const ImageView& depth, EdgesResult& result);
  FieldWindow network_window(const EdgeField& field, bool is_known);

  bool skips_planes_, measures_threads_;
  EdgeNetwork network_;
  RunCancel cancel_;
  WorkerThreads threads_;
  DepthAverage average_;
  ActiveWindow active_;
  DepthSlopes slopes_;
  FieldDecode decode_;
};

}  // namespace maq
