// The manifest of a model bundle (docs/formats.md), read and checked.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace maq {

// A size of a tensor: a number, or a name or formula ("height/4") for one that depends on the input.
using Dimension = std::variant<int64_t, std::string>;

struct TensorSpec {
  std::string name;
  std::string type;  // "float32"
  std::vector<Dimension> shape;
};

struct GraphSpec {
  std::string file;
  std::vector<TensorSpec> inputs;
  std::vector<TensorSpec> outputs;
};

struct FileSpec {
  std::string sha256;
  int64_t bytes = 0;
};

struct InputSpec {
  std::array<float, 3> mean{};  // of R, G, B, in 0..255
  std::array<float, 3> std{};
  int multiple_of = 32;
  int long_side_px = 0;
};

struct RpnSpec {
  std::vector<int> strides;
  std::vector<float> anchor_sizes_px;
  std::vector<float> aspect_ratios;  // height / width
  int pre_nms_top_k = 0;             // per level
  int post_nms_top_k = 0;            // over all levels
  float nms_iou = 0;
};

struct BoxHeadSpec {
  int pool = 0;
  std::vector<int> strides;
  int canonical_level = 0;
  float canonical_size_px = 0;
  std::array<float, 4> delta_weights{};
  float score_threshold = 0;
  float nms_iou = 0;
  std::optional<float> second_look_score;  // boxes with more are looked at again
  int max_people = 0;
};

struct DenseHeadSpec {
  std::string charts_file;
  int pool = 0;
  int stride = 0;
  int output = 0;
  int coarse_classes = 0;
  int index_classes = 0;
  float mask_threshold = 0;
  float least_own_share = 0;
};

enum class BundleTask { kDensePose, kScenes };

struct Manifest {
  BundleTask task = BundleTask::kDensePose;
  std::string name;
  std::string version;
  std::string precision;
  std::map<std::string, FileSpec> files;
  std::map<std::string, GraphSpec> graphs;
  // Of dense pose.
  InputSpec input;
  RpnSpec rpn;
  BoxHeadSpec box_head;
  DenseHeadSpec dense_head;
  std::string surface_file;  // "" when the bundle has none
  // Of scenes.
  std::string basis_file;
};

// Reads the text of a manifest. `origin` names it in errors.
// Throws MAQ_ERROR_BAD_BUNDLE for what is missing, of the wrong type or out of range, and MAQ_ERROR_UNSUPPORTED for
// a format version that this library does not know, or a bundle for another task.
Manifest parse_manifest(const std::string& text, const std::string& origin, BundleTask task = BundleTask::kDensePose);

}  // namespace maq
