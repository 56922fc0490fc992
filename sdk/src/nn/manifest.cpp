#include "nn/manifest.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/error.h"

namespace maq {
namespace {

using nlohmann::json;

constexpr char kRemedy[] = " Fetch or export the bundle again.";

// A place in the manifest: a JSON value with the path that leads to it, so that an error can name it.
class Node {
 public:
  Node(const json& value, std::string path, const std::string& origin)
      : value_(value), path_(std::move(path)), origin_(origin) {}

  template <class... Parts>
  [[noreturn]] void fail(const Parts&... parts) const {
    throw Error(MAQ_ERROR_BAD_BUNDLE, origin_, ": \"", path_, "\" ", parts..., ".", kRemedy);
  }

  Node at(const std::string& key) const {
    const std::string path = path_.empty() ? key : path_ + "." + key;
    if (!value_.is_object() || !value_.contains(key)) Node(value_, path, origin_).fail("is missing");
    return Node(value_.at(key), path, origin_);
  }

  // For what may be missing.
  std::optional<Node> find(const std::string& key) const {
    if (value_.is_object() && !value_.contains(key)) return std::nullopt;
    return at(key);
  }

  std::vector<Node> elements() const {
    if (!value_.is_array()) fail("is not a list");
    std::vector<Node> nodes;
    for (size_t i = 0; i < value_.size(); ++i) {
      nodes.emplace_back(value_[i], path_ + "[" + std::to_string(i) + "]", origin_);
    }
    return nodes;
  }

  std::vector<std::pair<std::string, Node>> members() const {
    if (!value_.is_object()) fail("is not an object");
    std::vector<std::pair<std::string, Node>> nodes;
    for (const auto& [key, value] : value_.items()) nodes.emplace_back(key, Node(value, path_ + "." + key, origin_));
    return nodes;
  }

  std::string text() const {
    if (!value_.is_string()) fail("is not a text");
    return value_.get<std::string>();
  }

  float number(double least, double most) const {
    if (!value_.is_number()) fail("is not a number");
    const double number = value_.get<double>();
    if (!std::isfinite(number) || number < least || number > most) {
      fail("is ", number, ", but must be ", least, " to ", most);
    }
    return float(number);
  }

  int integer(int least, int most) const {
    if (!value_.is_number_integer()) fail("is not a whole number");
    return int(number(least, most));
  }

  int64_t size() const {
    if (!value_.is_number_unsigned()) fail("is not a whole number of 0 or more");
    return value_.get<int64_t>();
  }

  Dimension dimension() const {
    if (value_.is_string()) return value_.get<std::string>();
    return int64_t(integer(1, 1 << 20));
  }

  template <size_t count>
  std::array<float, count> numbers(double least, double most) const {
    const std::vector<Node> nodes = elements();
    if (nodes.size() != count) fail("has ", nodes.size(), " entries, but must have ", count);
    std::array<float, count> result{};
    for (size_t i = 0; i < count; ++i) result[i] = nodes[i].number(least, most);
    return result;
  }

 private:
  const json& value_;
  std::string path_;
  const std::string& origin_;
};

FileSpec read_file_spec(const Node& node) {
  FileSpec file{node.at("sha256").text(), node.at("bytes").size()};
  if (file.sha256.size() != 64) node.at("sha256").fail("is not a SHA-256 of 64 hexadecimal digits");
  return file;
}

std::vector<TensorSpec> read_tensors(const Node& list) {
  std::vector<TensorSpec> tensors;
  for (const Node& node : list.elements()) {
    TensorSpec tensor{node.at("name").text(), node.at("type").text(), {}};
    for (const Node& size : node.at("shape").elements()) tensor.shape.push_back(size.dimension());
    tensors.push_back(std::move(tensor));
  }
  return tensors;
}

GraphSpec read_graph(const Node& node, const std::map<std::string, FileSpec>& files) {
  GraphSpec graph{node.at("file").text(), read_tensors(node.at("inputs")), read_tensors(node.at("outputs"))};
  if (files.count(graph.file) == 0) node.at("file").fail("names ", graph.file, ", which \"files\" does not list");
  return graph;
}

std::vector<int> read_strides(const Node& node, size_t count) {
  std::vector<int> strides;
  for (const Node& stride : node.elements()) strides.push_back(stride.integer(1, 1024));
  if (strides.size() != count) node.fail("has ", strides.size(), " entries, but must have ", count);
  return strides;
}

InputSpec read_input(const Node& node) {
  if (node.at("color").text() != "RGB") node.at("color").fail("must be RGB");
  InputSpec input;
  input.mean = node.at("mean").numbers<3>(-1e6, 1e6);
  input.std = node.at("std").numbers<3>(1e-6, 1e6);
  input.multiple_of = node.at("multiple_of").integer(1, 256);
  input.long_side_px = node.at("long_side").integer(32, 2048);
  return input;
}

RpnSpec read_rpn(const Node& node) {
  RpnSpec rpn;
  rpn.strides = read_strides(node.at("strides"), 5);
  for (const Node& size : node.at("anchor_sizes").elements()) rpn.anchor_sizes_px.push_back(size.number(1, 1e5));
  for (const Node& ratio : node.at("aspect_ratios").elements()) rpn.aspect_ratios.push_back(ratio.number(1e-3, 1e3));
  if (rpn.anchor_sizes_px.size() != rpn.strides.size()) node.at("anchor_sizes").fail("needs one size for each stride");
  if (rpn.aspect_ratios.size() != 3) node.at("aspect_ratios").fail("must have 3 entries");
  rpn.pre_nms_top_k = node.at("pre_nms_top_k").integer(1, 100000);
  rpn.post_nms_top_k = node.at("post_nms_top_k").integer(1, 10000);
  rpn.nms_iou = node.at("nms_iou").number(0, 1);
  return rpn;
}

BoxHeadSpec read_box_head(const Node& node) {
  BoxHeadSpec head;
  head.pool = node.at("pool").integer(1, 64);
  head.strides = read_strides(node.at("strides"), 4);
  head.canonical_level = node.at("canonical_level").integer(0, 16);
  head.canonical_size_px = node.at("canonical_size").number(1, 1e5);
  head.delta_weights = node.at("delta_weights").numbers<4>(1e-3, 1e3);
  head.score_threshold = node.at("score_threshold").number(0, 1);
  head.nms_iou = node.at("nms_iou").number(0, 1);
  if (const auto score = node.find("second_look_score")) head.second_look_score = score->number(0, 1);
  head.max_people = node.at("max_people").integer(1, 255);
  return head;
}

std::string read_listed_file(const Node& node, const std::map<std::string, FileSpec>& files) {
  const std::string file = node.text();
  if (files.count(file) == 0) node.fail("names ", file, ", which \"files\" does not list");
  return file;
}

DenseHeadSpec read_dense_head(const Node& node, const std::map<std::string, FileSpec>& files) {
  DenseHeadSpec head;
  head.charts_file = read_listed_file(node.at("charts"), files);
  head.pool = node.at("pool").integer(1, 128);
  head.stride = node.at("stride").integer(1, 1024);
  head.output = node.at("output").integer(1, 512);
  head.coarse_classes = node.at("coarse_classes").integer(2, 64);
  head.index_classes = node.at("index_classes").integer(2, 64);
  head.mask_threshold = node.at("mask_threshold").number(0.001, 0.999);
  head.least_own_share = node.at("least_own_share").number(0, 1);
  return head;
}

void read_dense_pose(const Node& root, Manifest& manifest) {
  for (const char* required : {"trunk", "rpn_fine", "rpn_coarse", "box_head", "dense_head"})
    root.at("graphs").at(required);
  manifest.input = read_input(root.at("input"));
  manifest.rpn = read_rpn(root.at("rpn"));
  manifest.box_head = read_box_head(root.at("box_head"));
  manifest.dense_head = read_dense_head(root.at("dense_head"), manifest.files);
  if (const auto surface = root.find("surface")) {
    manifest.surface_file = read_listed_file(surface->at("file"), manifest.files);
  }
}

void read_scenes(const Node& root, Manifest& manifest) {
  for (const char* required : {"extractor", "refiner"}) root.at("graphs").at(required);
  manifest.basis_file = read_listed_file(root.at("basis").at("file"), manifest.files);
}

void check_task(const std::string& found, BundleTask task, const std::string& name) {
  const bool is_scenes = task == BundleTask::kScenes;
  const char* wanted = is_scenes ? "scenes" : "densepose";
  if (found == wanted) return;
  throw Error(MAQ_ERROR_UNSUPPORTED, "Bundle ", name, " is for the task ", found, "; ",
              is_scenes ? "scenes need" : "dense pose needs", " a bundle with the task ", wanted, ".");
}

Manifest read_manifest(const Node& root, BundleTask task) {
  if (root.at("format").text() != "maquette-bundle") root.at("format").fail("must be maquette-bundle");
  const int format_version = root.at("format_version").integer(0, 1 << 20);
  if (format_version != 3) {
    throw Error(MAQ_ERROR_UNSUPPORTED, "The bundle has format version ", format_version,
                ", but this library reads version 3; use a bundle made for it, or a newer library.");
  }
  Manifest manifest;
  manifest.name = root.at("name").text();
  manifest.version = root.at("version").text();
  manifest.precision = root.at("precision").text();
  manifest.task = task;
  check_task(root.at("task").text(), task, manifest.name);
  for (const auto& [name, node] : root.at("files").members()) {
    // A manifest must not reach outside its folder.
    if (name.empty() || name.find('/') != std::string::npos || name[0] == '.') node.fail("is not a plain file name");
    manifest.files[name] = read_file_spec(node);
  }
  for (const auto& [name, node] : root.at("graphs").members()) {
    manifest.graphs[name] = read_graph(node, manifest.files);
  }
  task == BundleTask::kScenes ? read_scenes(root, manifest) : read_dense_pose(root, manifest);
  return manifest;
}

}  // namespace

Manifest parse_manifest(const std::string& text, const std::string& origin, BundleTask task) {
  const json document = json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (document.is_discarded() || !document.is_object()) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, origin, " is not a JSON object.", kRemedy);
  }
  return read_manifest(Node(document, "", origin), task);
}

}  // namespace maq
