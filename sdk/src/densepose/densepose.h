// Dense pose of one image: detector, box head, dense head and the decode between and after them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/frame.h"
#include "densepose/dense_decode.h"
#include "densepose/proposals.h"
#include "densepose/roi_align.h"
#include "image/network_input.h"
#include "nn/bundle.h"
#include "nn/session.h"

namespace maq {

struct DensePoseSettings {
  int threads = 1;
  int long_side_px = 0;
  float score_threshold = 0;
  int max_people = 0;
};

struct Person {
  Box box;  // in pixels of the image
  float score = 0;
};

struct DensePoseStats {
  float preprocess_ms = 0;
  float detector_ms = 0;
  float proposals_ms = 0;
  float box_head_ms = 0;
  float dense_head_ms = 0;
  float decode_ms = 0;
  float total_ms = 0;
  int network_width_px = 0;
  int network_height_px = 0;
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
  // Makes the three networks of `bundle`. Throws MAQ_ERROR_BAD_BUNDLE.
  DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle, const DensePoseSettings& settings);

  // Memory of `result` is reused. Not for two threads at once. Throws MAQ_ERROR_INFERENCE.
  void run(const ImageView& image, DensePoseResult& result);

 private:
  struct Pyramid {
    NetworkOutputs outputs;            // owns what the rest points to
    std::vector<FeatureMap> features;  // P2 to P5
    std::vector<RpnLevel> rpn;         // P2 to P6
  };

  Pyramid run_detector();
  std::vector<ScoredBox> run_box_head(const Pyramid& pyramid, const std::vector<ScoredBox>& proposals, int* dropped);
  // Paints the people, whose boxes are in pixels of the network's input, and adds those that got a pixel to `result`.
  void run_dense_head(const Pyramid& pyramid, const std::vector<ScoredBox>& people, DensePoseResult& result);
  const FeatureMap& level_for(const Pyramid& pyramid, const Box& box) const;

  Manifest manifest_;
  DensePoseSettings settings_;
  int channels_ = 0;
  std::unique_ptr<Session> detector_;
  std::unique_ptr<Session> box_head_;
  std::unique_ptr<Session> dense_head_;
  NetworkInput input_;
  std::vector<float> rois_;
};

}  // namespace maq
