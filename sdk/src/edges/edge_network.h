// The edge network of a bundle (docs/formats.md), for frames of any size.
#pragma once

#include <memory>
#include <vector>

#include "nn/bundle.h"
#include "nn/sized_sessions.h"

namespace maq {

class EdgeNetwork {
 public:
  // A session is made for each size when it is needed first. Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task,
  // and MAQ_ERROR_BAD_BUNDLE where the manifest lacks what is read, or the graph's input or output is not that of the
  // format; what Session throws where threads are measured.
  EdgeNetwork(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle, const SessionSettings& settings);
  EdgeNetwork(const EdgeNetwork&) = delete;
  EdgeNetwork& operator=(const EdgeNetwork&) = delete;

  // In use: where the settings have MAQ_THREADS_MEASURED, what was measured when this was made.
  int threads() const { return threads_; }
  // Where distances are cut off, in footprints.
  float eps_r() const { return eps_r_; }
  // Sides of what it is run on are multiples of it.
  int multiple_px() const { return multiple_px_; }

  // Room for the slopes of such a size, as DepthSlopes makes them.
  float* input(int width_px, int height_px);
  // These slopes -> planes as FieldDecode reads them, until the next use; the slopes are lost. Not for two threads at
  // once. Throws MAQ_ERROR_BAD_BUNDLE where the graph is not what the manifest says,
  // MAQ_ERROR_INFERENCE, MAQ_CANCELLED.
  const float* run(int width_px, int height_px, const RunCancel& cancel);

  // In use for the latest run.
  maq_provider provider() const { return provider_; }

 private:
  Bundle bundle_;
  float eps_r_ = 0;
  int multiple_px_ = 0;
  int threads_ = 0;
  bool is_shared_ = false;     // the graph has read its input before it writes its output
  std::vector<float> values_;  // its input and, where it is shared, its output
  SizedSessions sessions_;
  maq_provider provider_ = MAQ_PROVIDER_CPU;
  std::vector<TensorView> inputs_;
  std::vector<Shape> shapes_;
};

}  // namespace maq
