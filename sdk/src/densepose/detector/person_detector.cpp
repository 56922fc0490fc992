#include "densepose/detector/person_detector.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/rounding.h"
#include "core/trace/trace_section.h"

namespace maq {
namespace {

// Stable for every finite logit.
float logistic(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }

}  // namespace

PersonDetector::PersonDetector(const DensePoseNetworks& networks, const DensePoseSpec& spec,
                               const DensePoseSettings& settings)
    : spec_(spec), settings_(settings), trunk_(networks, spec) {
  const Manifest& manifest = networks.bundle().manifest;
  const int channels = trunk_.channels(), first = Trunk::kFirstLevel, last = first + int(Trunk::kAllLevels) - 1;
  const std::vector<int64_t> features = {1, kAnySize, kAnySize, channels};
  const std::vector<int64_t> anchors = {1, kAnySize, kAnySize, 5 * int64_t(spec_.rpn.aspect_ratios.size())};
  rpn_fine_ = networks.open(
      "rpn_fine", graph_with(manifest, "rpn_fine", at_levels("p", first, first), at_levels("rpn", first, first)),
      features, {anchors}, networks.on_cpu());
  rpn_coarse_ = networks.open(
      "rpn_coarse",
      graph_with(manifest, "rpn_coarse", at_levels("p", first + 1, last), at_levels("rpn", first + 1, last)), features,
      {anchors}, networks.on_cpu());
  const int64_t pool = spec_.box_head.pool_size;
  box_head_ = networks.open("box_head", graph_with(manifest, "box_head", {"rois"}, {"boxes"}),
                            {kAnySize, pool, pool, channels}, {{kAnySize, 6}}, networks.on_provider());
}

const std::vector<ScoredBox>& PersonDetector::run(const ImageView& image, const RotatedInput& seen,
                                                  const std::vector<ScoredBox>* followed, float min_score,
                                                  RunCancel& cancel, DetectorStats& stats) {
  Stopwatch stage;
  TraceSection trace("maquette resize");
  const NetworkSize padded{round_up(seen.size.width_px, spec_.input.multiple_of),
                           round_up(seen.size.height_px, spec_.input.multiple_of)};
  const bool is_rotated = seen.roll_steps != 0;
  if (is_rotated) {
    make_crop_input(image, seen.to_image, padded, spec_.input, rotated_);
  } else {
    make_network_input(image, seen.size, spec_.input, input_);
  }
  stats.preprocess_ms += float(stage.lap_ms());

  trace.next("maquette detector");
  const std::vector<float>& values = is_rotated ? rotated_.values : input_.values;
  stats.provider = trunk_.run(values, padded.width_px, padded.height_px, cancel);
  stats.trunk_ms += float(stage.lap_ms());

  trace.next("maquette boxes");
  if (followed == nullptr) {
    propose(seen, cancel, &stats.dropped_boxes);
  } else {
    proposals_ = *followed;
  }
  stats.proposals += int(proposals_.size());
  stats.proposals_ms += float(stage.lap_ms());

  // Followed boxes went through the box head in the previous frame, so that this is their second pass.
  if (followed == nullptr && spec_.box_head.second_pass_threshold) {
    run_box_head(proposals_, seen, std::min(min_score, *spec_.box_head.second_pass_threshold), cancel, found_,
                 &stats.dropped_boxes);
    proposals_.swap(found_);
  }
  run_box_head(proposals_, seen, min_score, cancel, found_, &stats.dropped_boxes);
  stats.box_head_ms += float(stage.lap_ms());
  return found_;
}

void PersonDetector::propose(const RotatedInput& seen, RunCancel& cancel, int* dropped) {
  const std::vector<TensorView>& pyramid = trunk_.pyramid();
  rpn_levels_.assign(Trunk::kAllLevels, {});
  // Runs a graph of the RPN on `count` levels from `first` on.
  const auto run_rpn = [&](Session& rpn, size_t first, size_t count) {
    inputs_.assign(pyramid.begin() + std::ptrdiff_t(first), pyramid.begin() + std::ptrdiff_t(first + count));
    const int64_t anchors = int64_t(spec_.rpn.aspect_ratios.size());
    shapes_.clear();
    for (const TensorView& map : inputs_) shapes_.push_back({1, map.shape[1], map.shape[2], 5 * anchors});
    const std::vector<TensorView>& outputs = rpn.run(inputs_, shapes_, &cancel);
    for (size_t l = 0; l < count; ++l) {
      rpn_levels_[first + l] = {outputs[l].data, int(inputs_[l].shape[2]), int(inputs_[l].shape[1])};
    }
  };
  run_rpn(*rpn_coarse_, 1, Trunk::kAllLevels - 1);
  // The finest anchors are for boxes smaller than the geometric mean of their side and the next level's. A standing
  // person is about three times as high as wide, so that the box's side (root of its area) is height / sqrt(3).
  const float scale = float(1 / std::hypot(seen.to_image.xy, seen.to_image.yy));
  const std::vector<float>& sizes = spec_.rpn.anchor_sizes_px;
  if (float(settings_.min_person_height_px) * scale < std::sqrt(3.0f * sizes[0] * sizes[1])) run_rpn(*rpn_fine_, 0, 1);
  select_proposals(rpn_levels_, spec_.rpn, settings_.max_proposals, float(seen.size.width_px),
                   float(seen.size.height_px), candidates_, proposals_, dropped);
}

// The larger the box, the coarser the level (Lin et al., Feature Pyramid Networks, 2017, equation 1).
const FeatureMap& PersonDetector::level_for(const Box& box) const {
  const BoxHeadSpec& spec = spec_.box_head;
  const double level = std::floor(spec.canonical_level +
                                  std::log2(std::sqrt(double(box.area())) / double(spec.canonical_size_px) + 1e-8));
  const int first = Trunk::kFirstLevel;
  const int slot = int(std::clamp(level, double(first), double(first + int(Trunk::kFeatureLevels) - 1))) - first;
  return trunk_.features()[size_t(slot)];
}

float PersonDetector::mean_person_logit(const Box& box) {
  float mean = 0;
  if (trunk_.person_logits().data != nullptr) roi_align_.run(trunk_.person_logits(), box, 1, &mean);
  return mean;
}

void PersonDetector::run_box_head(const std::vector<ScoredBox>& boxes, const RotatedInput& seen, float min_score,
                                  RunCancel& cancel, std::vector<ScoredBox>& found, int* dropped) {
  found.clear();
  if (boxes.empty()) return;
  const BoxHeadSpec& spec = spec_.box_head;
  const int64_t count = int64_t(boxes.size()), channels = trunk_.channels();
  const size_t roi_size = size_t(channels) * size_t(spec.pool_size) * size_t(spec.pool_size);
  rois_.resize(size_t(count) * roi_size);
  for (size_t i = 0; i < boxes.size(); ++i) {
    cancel.check();
    roi_align_.run(level_for(boxes[i].box), boxes[i].box, spec.pool_size, rois_.data() + i * roi_size);
  }
  // Outputs of each box: logits of person and background, then dx, dy, dw, dh.
  inputs_.assign(1, {rois_.data(), {count, spec.pool_size, spec.pool_size, channels}});
  shapes_.assign(1, {count, 6});
  const TensorView& outputs = box_head_->run(inputs_, shapes_, &cancel).front();

  for (size_t i = 0; i < boxes.size(); ++i) {
    const float* logits = outputs.data + 6 * i;
    const float score = logistic(logits[0] - logits[1] + mean_person_logit(boxes[i].box));
    Box box = apply_deltas(boxes[i].box, outputs.data + 6 * i + 2, spec.delta_weights);
    if (std::isnan(score) || !clip_box(box, float(seen.size.width_px), float(seen.size.height_px))) {
      ++*dropped;
    } else if (score > min_score) {
      found.push_back({box, score, int64_t(i)});
    }
  }
  non_maximum_suppression(found, spec.nms_iou, size_t(settings_.max_people));
}

}  // namespace maq
