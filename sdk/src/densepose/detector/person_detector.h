// Finds the boxes of people in an image: trunk, region proposals, box head.
#pragma once

#include <memory>
#include <vector>

#include "core/frame.h"
#include "densepose/bundle/settings.h"
#include "densepose/detector/proposals.h"
#include "densepose/detector/rotated_input.h"
#include "densepose/detector/trunk.h"
#include "image/crop_input.h"
#include "image/network_input.h"

namespace maq {

struct DetectorStats {
  float preprocess_ms = 0;
  float trunk_ms = 0;
  float proposals_ms = 0;
  float box_head_ms = 0;
  int proposals = 0;      // boxes that reached the box head
  int dropped_boxes = 0;  // boxes with NaN, or with no area inside the image
  maq_provider provider = MAQ_PROVIDER_CPU;
};

class PersonDetector {
 public:
  // The settings are resolved: defaults are replaced by the bundle's values. `spec` and `settings` must outlive this.
  PersonDetector(const DensePoseNetworks& networks, const DensePoseSpec& spec, const DensePoseSettings& settings);

  // Finds people in the image as `seen` shows it, with scores above `min_score`, best first, in pixels of the network's
  // input. `followed`: boxes of the previous frame, which take the place of proposals; nullptr: they are searched. Adds
  // to `stats`. The result is valid until the next run. Throws MAQ_ERROR_INFERENCE, MAQ_CANCELLED.
  const std::vector<ScoredBox>& run(const ImageView& image, const RotatedInput& seen,
                                    const std::vector<ScoredBox>* followed, float min_score, RunCancel& cancel,
                                    DetectorStats& stats);

  // It has the features of the latest image.
  Trunk& trunk() { return trunk_; }

 private:
  // Selects the best boxes of the RPN. Its finest level runs only if people of min_person_height_px may be that small.
  void propose(const RotatedInput& seen, RunCancel& cancel, int* dropped);
  // Runs the box head once: scores and refines `boxes`, keeps scores above `min_score`, then applies NMS.
  void run_box_head(const std::vector<ScoredBox>& boxes, const RotatedInput& seen, float min_score, RunCancel& cancel,
                    std::vector<ScoredBox>& found, int* dropped);
  const FeatureMap& level_for(const Box& box) const;
  // Returns the mean of the person-logit map over the box; 0 if the bundle has no such map.
  float mean_person_logit(const Box& box);

  const DensePoseSpec& spec_;
  const DensePoseSettings& settings_;
  Trunk trunk_;
  std::unique_ptr<Session> rpn_fine_, rpn_coarse_, box_head_;
  // Scratch of a frame, kept so that the next one takes nothing from the heap.
  NetworkInput input_;
  CropInput rotated_;
  RoiAlign roi_align_;
  std::vector<float> rois_;
  std::vector<RpnCandidate> candidates_;
  std::vector<RpnLevel> rpn_levels_;
  std::vector<ScoredBox> proposals_, found_;
  std::vector<TensorView> inputs_;
  std::vector<Shape> shapes_;
};

}  // namespace maq
