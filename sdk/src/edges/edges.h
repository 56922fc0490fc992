// The distance-to-feature field of depth frames: slopes, network, decode (DEF, arXiv 2011.15081).
#pragma once

#include <cstdint>
#include <memory>

#include "core/frame.h"
#include "core/worker_threads.h"
#include "edges/active_window.h"
#include "edges/edge_field.h"
#include "edges/edge_network.h"
#include "edges/field_decode.h"
#include "edges/resting_depth.h"
#include "maquette/source.h"

namespace maq {

// As in maq_edges_config, whose comments say what they mean.
struct EdgesSettings {
  int threads = 1;  // or MAQ_THREADS_MEASURED
  bool spin = true;
  maq_provider provider = MAQ_PROVIDER_CPU;
  bool skips_planes = false;
  int average_frames = 1;
};

struct EdgesStats {
  float depth_ms = 0;   // to metres, and the mean with frames before
  float skip_ms = 0;    // where the network must run
  float slopes_ms = 0;  // the network's input
  float network_ms = 0;
  float decode_ms = 0;
  float total_ms = 0;
  int64_t known_pixels = 0;
  int64_t network_pixels = 0;   // that it was run on
  int64_t broken_pixels = 0;    // for which it gave no number
  int64_t averaged_pixels = 0;  // whose depth is the mean of several frames
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
  // Of a frame, with the padding that the network wants. It takes some 300 bytes a pixel.
  static constexpr int64_t kMaxPixels = int64_t(1) << 23;

  // Throws what EdgeNetwork throws.
  Edges(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle, const EdgesSettings& settings);
  Edges(const Edges&) = delete;
  Edges& operator=(const Edges&) = delete;

  // Of a depth image and the camera that took it, which has its size. Memory of `result` is reused. Not for two threads
  // at once. Throws MAQ_ERROR_UNSUPPORTED for an image that is not depth, MAQ_ERROR_INVALID_ARGUMENT for intrinsics of
  // another size, or that are not finite with positive focal lengths; MAQ_ERROR_IMAGE_SIZE, MAQ_ERROR_BAD_BUNDLE,
  // MAQ_ERROR_INFERENCE, MAQ_CANCELLED.
  void run(const ImageView& depth, const Intrinsics& intrinsics, EdgesResult& result);
  // Of a frame's own pixels, or of the depth that came with its picture: then `camera` may be that of the picture,
  // which shows the same view. Distortion is left out of account.
  void run(const Frame& frame, const maq_intrinsics& camera, EdgesResult& result);
  // In use.
  int threads() const { return network_.threads(); }
  // From any thread: ends the run that runs, or else the next.
  void cancel() noexcept { cancel_.cancel(); }

 private:
  void find_field(const ImageView& depth, EdgesResult& result);
  FieldWindow network_window(const EdgeField& field, bool is_known);

  bool skips_planes_, measures_threads_;
  EdgeNetwork network_;
  RunCancel cancel_;
  WorkerThreads threads_;
  RestingDepth resting_;
  ActiveWindow active_;
  DepthSlopes slopes_;
  FieldDecode decode_;
};

}  // namespace maq
