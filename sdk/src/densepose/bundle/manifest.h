// The part of a manifest that describes dense pose (docs/reference/formats.md), read and checked.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "image/network_input.h"
#include "nn/manifest.h"

namespace maq {

struct RpnSpec {
  std::vector<int> strides;
  std::vector<float> anchor_sizes_px;
  std::vector<float> aspect_ratios;  // height / width
  int pre_nms_top_k = 0;             // per level
  int post_nms_top_k = 0;            // over all levels
  float nms_iou = 0;
};

struct BoxHeadSpec {
  int pool_size = 0;  // cells of a RoI each way
  std::vector<int> strides;
  int canonical_level = 0;
  float canonical_size_px = 0;
  std::array<float, 4> delta_weights{};
  float score_threshold = 0;
  float nms_iou = 0;
  // Boxes with a higher score go through the box head again, from where its first pass put them; none: one pass.
  std::optional<float> second_pass_threshold;
  // Stride of the person-logit map, the trunk's output `person`; 0: the trunk has none. Its mean over a box is added to
  // the logit of a person.
  int person_logits_stride = 0;
  int max_people = 0;
};

struct DenseHeadSpec {
  int pool_size = 0;
  int stride = 0;
  int output_size = 0;
  int coarse_classes = 0;
  int index_classes = 0;
  float mask_threshold = 0;
  float min_visible_fraction = 0;  // a person of whom less is in front of better scored ones is dropped
};

struct DensePoseSpec {
  NetworkInputSpec input;
  int long_side_px = 0;  // of an image as it enters the network
  RpnSpec rpn;
  BoxHeadSpec box_head;
  DenseHeadSpec dense_head;
  std::string charts_file;
  std::string surface_file;      // "" when the bundle has none
  int keypoints = 0;             // how many the bundle finds of a person; 0: it has no network for them
  std::string crop_charts_file;  // "" if crops use the networks of the whole image
};

// Throws MAQ_ERROR_UNSUPPORTED for a bundle of another task, and MAQ_ERROR_BAD_BUNDLE for a value that is missing, of
// the wrong type or out of range.
DensePoseSpec read_densepose_spec(const Manifest& manifest);

// Its graphs, as the runtime uses them: tensors by name, with shapes that fit the manifest's other values. All of these
// throw MAQ_ERROR_BAD_BUNDLE for a missing or different value.
constexpr int64_t kAnySize = -1;

// Names of tensors at the levels from `first` to `last`: "p3", "p4", …
std::vector<std::string> at_levels(const std::string& name, int first, int last);

// A graph with its tensors of these names, in this order; the manifest may list more, in any order.
GraphSpec graph_with(const Manifest& manifest, const std::string& graph, const std::vector<std::string>& inputs,
                     const std::vector<std::string>& outputs);

// Returns the channels of P2, the first output of a trunk; all levels have as many.
int feature_channels(const GraphSpec& trunk, const std::string& bundle_name);

// The shapes of all inputs and outputs. The last output shape also counts for all further outputs. Where the manifest
// has a name for a size that must be known, the tensor gets the number, so that Session compares it with the graph.
// `where` begins an error's text.
void require_shapes(GraphSpec& graph, const std::vector<int64_t>& input,
                    const std::vector<std::vector<int64_t>>& outputs, const std::string& where);

}  // namespace maq
