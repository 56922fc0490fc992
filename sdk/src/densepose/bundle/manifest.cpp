#include "densepose/bundle/manifest.h"

#include <algorithm>
#include <variant>

#include "core/error.h"

namespace maq {
namespace {

std::vector<int> read_strides(const ManifestNode& node, size_t count) {
  std::vector<int> strides;
  for (const ManifestNode& stride : node.elements()) strides.push_back(stride.integer(1, 1024));
  if (strides.size() != count) node.fail("has ", strides.size(), " entries, but must have ", count);
  return strides;
}

NetworkInputSpec read_input(const ManifestNode& node) {
  if (node.at("color").text() != "RGB") node.at("color").fail("must be RGB");
  NetworkInputSpec input;
  input.mean = node.at("mean").numbers<3>(-1e6, 1e6);
  input.std = node.at("std").numbers<3>(1e-6, 1e6);
  input.multiple_of = node.at("multiple_of").integer(1, 256);
  return input;
}

RpnSpec read_rpn(const ManifestNode& node) {
  RpnSpec rpn;
  rpn.strides = read_strides(node.at("strides"), 5);
  for (const ManifestNode& size : node.at("anchor_sizes_px").elements()) {
    rpn.anchor_sizes_px.push_back(size.number(1, 1e5));
  }
  for (const ManifestNode& ratio : node.at("aspect_ratios").elements()) {
    rpn.aspect_ratios.push_back(ratio.number(1e-3, 1e3));
  }
  if (rpn.anchor_sizes_px.size() != rpn.strides.size())
    node.at("anchor_sizes_px").fail("needs one size for each stride");
  if (rpn.aspect_ratios.size() != 3) node.at("aspect_ratios").fail("must have 3 entries");
  rpn.pre_nms_top_k = node.at("pre_nms_top_k").integer(1, 100000);
  rpn.post_nms_top_k = node.at("post_nms_top_k").integer(1, 10000);
  rpn.nms_iou = node.at("nms_iou").number(0, 1);
  return rpn;
}

BoxHeadSpec read_box_head(const ManifestNode& node) {
  BoxHeadSpec head;
  head.pool_size = node.at("pool_size").integer(1, 64);
  head.strides = read_strides(node.at("strides"), 4);
  head.canonical_level = node.at("canonical_level").integer(0, 16);
  head.canonical_size_px = node.at("canonical_size_px").number(1, 1e5);
  head.delta_weights = node.at("delta_weights").numbers<4>(1e-3, 1e3);
  head.score_threshold = node.at("score_threshold").number(0, 1);
  head.nms_iou = node.at("nms_iou").number(0, 1);
  if (const auto threshold = node.find("second_pass_threshold")) head.second_pass_threshold = threshold->number(0, 1);
  if (const auto stride = node.find("evidence_stride")) head.person_logits_stride = stride->integer(1, 1024);
  head.max_people = node.at("max_people").integer(1, 255);
  return head;
}

DenseHeadSpec read_dense_head(const ManifestNode& node) {
  DenseHeadSpec head;
  head.pool_size = node.at("pool_size").integer(1, 128);
  head.stride = node.at("stride").integer(1, 1024);
  head.output_size = node.at("output_size").integer(1, 512);
  head.coarse_classes = node.at("coarse_classes").integer(2, 64);
  head.index_classes = node.at("index_classes").integer(2, 64);
  head.mask_threshold = node.at("mask_threshold").number(0.001, 0.999);
  head.min_visible_fraction = node.at("min_visible_fraction").number(0, 1);
  return head;
}

// Selects the tensors of a graph that are called `names`, in this order; the manifest may list more, in any order.
std::vector<TensorSpec> named(const std::vector<TensorSpec>& tensors, const std::vector<std::string>& names,
                              const std::string& where) {
  std::vector<TensorSpec> chosen;
  for (const std::string& name : names) {
    const auto found =
        std::find_if(tensors.begin(), tensors.end(), [&](const TensorSpec& tensor) { return tensor.name == name; });
    if (found == tensors.end()) throw Error(MAQ_ERROR_BAD_BUNDLE, where, " ", name, ". Export the bundle again.");
    chosen.push_back(*found);
  }
  return chosen;
}

void require_shape(TensorSpec& tensor, const std::vector<int64_t>& shape, const std::string& where) {
  const auto fail = [&] {
    std::string text;
    for (const int64_t size : shape)
      text += (text.empty() ? "" : ", ") + (size == kAnySize ? "n" : std::to_string(size));
    throw Error(MAQ_ERROR_BAD_BUNDLE, where, tensor.name, " must have the shape [", text,
                "] by the manifest's other values, but its graph lists another. Export the bundle again.");
  };
  if (tensor.shape.size() != shape.size()) fail();
  for (size_t axis = 0; axis < shape.size(); ++axis) {
    if (shape[axis] == kAnySize) continue;
    const int64_t* listed = std::get_if<int64_t>(&tensor.shape[axis]);
    if (listed != nullptr && *listed != shape[axis]) fail();
    tensor.shape[axis] = shape[axis];
  }
}

}  // namespace

DensePoseSpec read_densepose_spec(const Manifest& manifest) {
  manifest.require_task("densepose");
  manifest.require_graphs({"trunk", "rpn_fine", "rpn_coarse", "box_head", "dense_head"});
  DensePoseSpec spec;
  spec.input = read_input(manifest.root.at("input"));
  spec.long_side_px = manifest.root.at("input").at("long_side_px").integer(32, 2048);
  spec.rpn = read_rpn(manifest.root.at("rpn"));
  spec.box_head = read_box_head(manifest.root.at("box_head"));
  spec.dense_head = read_dense_head(manifest.root.at("dense_head"));
  spec.charts_file = manifest.listed_file(manifest.root.at("charts").at("file"));
  if (const auto surface = manifest.root.find("surface")) {
    spec.surface_file = manifest.listed_file(surface->at("file"));
  }
  if (const auto keypoints = manifest.root.find("keypoints")) {
    manifest.require_graphs({"keypoints"});
    spec.keypoints = keypoints->at("count").integer(1, 1024);
  }
  if (const auto charts = manifest.root.find("crop_charts")) {
    manifest.require_graphs({"crop_trunk", "crop_dense_head"});
    spec.crop_charts_file = manifest.listed_file(charts->at("file"));
  }
  return spec;
}

std::vector<std::string> at_levels(const std::string& name, int first, int last) {
  std::vector<std::string> all;
  for (int level = first; level <= last; ++level) all.push_back(name + std::to_string(level));
  return all;
}

GraphSpec graph_with(const Manifest& manifest, const std::string& graph, const std::vector<std::string>& inputs,
                     const std::vector<std::string>& outputs) {
  const std::string where = concatenate("Bundle ", manifest.name, ": graph ", graph, " lists no ");
  const GraphSpec& listed = manifest.graphs.at(graph);
  return {listed.file, named(listed.inputs, inputs, where + "input"), named(listed.outputs, outputs, where + "output")};
}

int feature_channels(const GraphSpec& trunk, const std::string& bundle_name) {
  const std::vector<Dimension>& shape = trunk.outputs[0].shape;
  const int64_t* channels = shape.size() == 4 ? std::get_if<int64_t>(&shape[3]) : nullptr;
  if (channels == nullptr) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", bundle_name,
                ": output p2 of the trunk must have the shape [1, h, w, channels] with a number of channels. "
                "Export the bundle again.");
  }
  return int(*channels);
}

void require_shapes(GraphSpec& graph, const std::vector<int64_t>& input,
                    const std::vector<std::vector<int64_t>>& outputs, const std::string& where) {
  for (TensorSpec& tensor : graph.inputs) require_shape(tensor, input, where + "input ");
  for (size_t i = 0; i < graph.outputs.size(); ++i) {
    require_shape(graph.outputs[i], outputs[std::min(i, outputs.size() - 1)], where + "output ");
  }
}

}  // namespace maq
