// Dense pose of one image: detector, box head, dense head and the decode between and after them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/frame.h"
#include "densepose/chart_predictor.h"
#include "densepose/dense_decode.h"
#include "densepose/manifest.h"
#include "densepose/proposals.h"
#include "densepose/roi_align.h"
#include "densepose/surface_grid.h"
#include "image/network_input.h"
#include "nn/bundle.h"
#include "nn/session.h"

namespace maq {

// As in maq_densepose_config, whose comments say what they mean; 0 (a negative threshold): the bundle's value.
struct DensePoseSettings {
  int threads = 1;
  int long_side_px = 0;
  float score_threshold = -1;
  int max_people = 0;
  int max_proposals = 0;
  int key_frame_interval = 1;
  int min_person_height_px = 0;
  bool surface = true;
  bool spin = true;
};

struct Person {
  Box box;  // in pixels of the image
  float score = 0;
};

struct DensePoseStats {
  float preprocess_ms = 0;
  float trunk_ms = 0;  // backbone and FPN neck
  float proposals_ms = 0;
  float box_head_ms = 0;
  float dense_head_ms = 0;
  float decode_ms = 0;
  float total_ms = 0;
  int network_width_px = 0;
  int network_height_px = 0;
  bool key_frame = false;
  int proposals = 0;
  int dropped_boxes = 0;
  DecodeCounts decoded;
};

struct DensePoseResult {
  std::vector<Person> people;  // best score first; each has at least one pixel of `planes`
  DensePlanes planes;
  DensePoseStats stats;
};

class DensePose {
 public:
  // Makes the networks of `bundle`, which is not needed afterwards. Throws MAQ_ERROR_BAD_BUNDLE, and
  // MAQ_ERROR_UNSUPPORTED for a bundle of another task.
  DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle, const DensePoseSettings& settings);

  // Memory of `result` is reused. Not for two threads at once. With key_frame_interval above 1 images are frames of one
  // stream: between key frames the boxes of the frame before take the place of proposals. Throws MAQ_ERROR_INFERENCE,
  // MAQ_CANCELLED.
  void run(const ImageView& image, DensePoseResult& result);
  // From any thread: ends the run that runs, or else the next.
  void cancel() noexcept { cancel_->cancel(); }
  // The next image begins another stream.
  void reset();

  // Where on the body labels lie; from any thread, also during run(). Throws what BodySurface::grid() throws.
  const SurfaceGrid& surface() { return surface_.grid(); }

 private:
  void find_people(const ImageView& image, DensePoseResult& result);
  void run_trunk();
  // The best boxes of the RPN. Its finest level runs only where people of min_person_height_px may be that small.
  void propose(int image_height_px, std::vector<ScoredBox>& found, int* dropped);
  // One pass of the box head: scores and refines `boxes`, keeps those of a score above `min_score`, then NMS.
  void run_box_head(const std::vector<ScoredBox>& boxes, float min_score, std::vector<ScoredBox>& found, int* dropped);
  // Paints the people, whose boxes are in pixels of the network's input, and adds those that got a pixel to `result`.
  void run_dense_head(const std::vector<ScoredBox>& people, DensePoseResult& result);
  const FeatureMap& level_for(const Box& box) const;

  DensePoseSpec spec_;
  DensePoseSettings settings_;  // none is 0 that stands for the bundle's value
  int channels_ = 0;
  std::unique_ptr<RunCancel> cancel_;
  std::unique_ptr<Session> trunk_;
  std::unique_ptr<Session> rpn_fine_;
  std::unique_ptr<Session> rpn_coarse_;
  std::unique_ptr<Session> box_head_;
  std::unique_ptr<Session> dense_head_;
  ChartPredictor charts_;
  BodySurface surface_;
  NetworkInput input_;
  std::vector<TensorView> pyramid_;   // P2 to P6, in memory of the trunk
  std::vector<FeatureMap> features_;  // P2 to P5, the same
  std::vector<float> rois_;
  // Scratch of a frame, kept so that the next one takes nothing from the heap.
  RoiAlign roi_align_;
  DecodeMemory decode_memory_;
  std::vector<RpnCandidate> candidates_;
  std::vector<RpnLevel> rpn_levels_;
  std::vector<ScoredBox> proposals_, found_;
  std::vector<TensorView> inputs_;
  std::vector<Shape> shapes_;
  // Boxes of the frame before, in pixels of the network's input, to be propagated; and frames since the last key frame.
  std::vector<ScoredBox> tracked_;
  int frames_since_key_ = 0;
};

}  // namespace maq
