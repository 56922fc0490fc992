// The edge network of a bundle (docs/reference/formats.md), for frames of any size.
#pragma once

#include <memory>
#include <vector>

#include "nn/bundle.h"
#include "nn/sized_sessions.h"

namespace maq {

class EdgeNetwork {
 public:
  // Creates a session for each size when it is first needed. Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task,
  // MAQ_ERROR_BAD_BUNDLE for an incomplete manifest or a graph with another input or output than the format, and the
  // errors of Session while threads are measured.
  EdgeNetwork(std::shared_ptr<const OnnxRuntimeLibrary> runtime, Bundle bundle, const SessionSettings& settings);
  EdgeNetwork(const EdgeNetwork&) = delete;
  EdgeNetwork& operator=(const EdgeNetwork&) = delete;

  // Returns the number of threads in use; with MAQ_THREADS_MEASURED, the measured number.
  int threads() const { return threads_; }
  // Returns the largest distance, in footprints.
  float eps_r() const { return eps_r_; }
  // The sides of the input must be multiples of this number.
  int multiple_px() const { return multiple_px_; }

  // Returns memory for the slopes of an input of this size (DepthSlopes).
  float* input(int width_px, int height_px);
  // Runs the network on the slopes and overwrites them. Returns planes for FieldDecode, valid until the next use. One
  // thread at a time. Throws MAQ_ERROR_BAD_BUNDLE if the graph does not fit its manifest,
  // MAQ_ERROR_INFERENCE, MAQ_CANCELLED.
  const float* run(int width_px, int height_px, const RunCancel& cancel);

  // Returns the provider of the latest run.
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
