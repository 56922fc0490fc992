#include "densepose/densepose.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"

namespace maq {
namespace {

constexpr size_t kFeatureLevels = 4;  // P2 to P5, which the heads read
constexpr size_t kRpnLevels = 5;      // P2 to P6
constexpr int kFirstLevel = 2;

// Names of tensors at the levels from `first` to `last`: "p3", "p4", …
std::vector<std::string> at_levels(const std::string& name, int first, int last) {
  std::vector<std::string> all;
  for (int level = first; level <= last; ++level) all.push_back(name + std::to_string(level));
  return all;
}

// Those of a graph's tensors that are called `names`, in this order; the manifest may list more, in any order.
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

GraphSpec graph_with(const Manifest& manifest, const std::string& graph, const std::vector<std::string>& inputs,
                     const std::vector<std::string>& outputs) {
  const std::string where = concatenate("Bundle ", manifest.name, ": graph ", graph, " lists no ");
  const GraphSpec& listed = manifest.graphs.at(graph);
  return {listed.file, named(listed.inputs, inputs, where + "input"), named(listed.outputs, outputs, where + "output")};
}

// Of P2, and so of all levels.
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

// Settings with the bundle's values in place of zeros.
DensePoseSettings resolved(DensePoseSettings settings, const DensePoseSpec& spec) {
  if (settings.long_side_px == 0) settings.long_side_px = spec.long_side_px;
  if (settings.score_threshold < 0) settings.score_threshold = spec.box_head.score_threshold;
  if (settings.max_people == 0) settings.max_people = spec.box_head.max_people;
  if (settings.max_proposals == 0) settings.max_proposals = spec.rpn.post_nms_top_k;
  return settings;
}

Box scaled(const Box& box, float x, float y) { return {box.x0 * x, box.y0 * y, box.x1 * x, box.y1 * y}; }

// Probability of the first of two classes; stable for every finite logit.
float first_of_two(const float* logits) { return 1.0f / (1.0f + std::exp(logits[1] - logits[0])); }

}  // namespace

DensePose::DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle,
                     const DensePoseSettings& settings)
    : spec_(read_densepose_spec(bundle.manifest)),
      settings_(resolved(settings, spec_)),
      charts_(bundle.files.at(spec_.charts_file), spec_.dense_head.index_classes - 1,
              bundle.path_of(spec_.charts_file)),
      surface_(spec_.surface_file.empty() ? std::vector<uint8_t>() : bundle.files.at(spec_.surface_file),
               bundle.path_of(spec_.surface_file)) {
  cancel_ = std::make_unique<RunCancel>(runtime);
  const Manifest& manifest = bundle.manifest;
  const auto make = [&](const GraphSpec& graph) {
    return std::make_unique<Session>(runtime, bundle.files.at(graph.file), graph, bundle.path_of(graph.file),
                                     SessionSettings{settings_.threads, settings_.spin});
  };
  const int first = kFirstLevel, last = kFirstLevel + int(kRpnLevels) - 1;
  const GraphSpec trunk = graph_with(manifest, "trunk", {"image"}, at_levels("p", first, last));
  channels_ = feature_channels(trunk, manifest.name);
  trunk_ = make(trunk);
  rpn_fine_ = make(graph_with(manifest, "rpn_fine", at_levels("p", first, first), at_levels("rpn", first, first)));
  rpn_coarse_ =
      make(graph_with(manifest, "rpn_coarse", at_levels("p", first + 1, last), at_levels("rpn", first + 1, last)));
  box_head_ = make(graph_with(manifest, "box_head", {"rois"}, {"boxes"}));
  dense_head_ = make(graph_with(manifest, "dense_head", {"rois"}, {"labels", "surface"}));
  if (spec_.dense_head.output_size != 2 * spec_.dense_head.pool_size) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": the dense head's output is ",
                spec_.dense_head.output_size, " cells wide, but must be twice its pool of ", spec_.dense_head.pool_size,
                ". Export the bundle again.");
  }
}

void DensePose::run(const ImageView& image, DensePoseResult& result) {
  // However this ends, a cancel of this run does not cancel a later one.
  struct Reset {
    RunCancel& cancel;
    ~Reset() { cancel.reset(); }
  } const after{*cancel_};
  try {
    find_people(image, result);
  } catch (...) {
    reset();  // of the frame's boxes, some may be missing
    throw;
  }
}

void DensePose::find_people(const ImageView& image, DensePoseResult& result) {
  cancel_->check();
  Stopwatch total, stage;
  DensePoseStats& stats = result.stats;
  stats = {};
  result.people.clear();
  result.planes.reset(image.width_px, image.height_px);

  const NetworkSize size = network_size(image.width_px, image.height_px, settings_.long_side_px);
  stats.network_width_px = size.width_px;
  stats.network_height_px = size.height_px;
  const bool is_same_stream = size.width_px == input_.width_px && size.height_px == input_.height_px;
  stats.key_frame = !is_same_stream || frames_since_key_ == 0;
  frames_since_key_ = stats.key_frame ? 1 : frames_since_key_ + 1;
  if (frames_since_key_ >= settings_.key_frame_interval) frames_since_key_ = 0;
  // Without boxes to propagate nothing runs until the next key frame.
  if (stats.key_frame || !tracked_.empty()) {
    make_network_input(image, size, spec_.input, input_);
    stats.preprocess_ms = float(stage.lap_ms());

    run_trunk();
    stats.trunk_ms = float(stage.lap_ms());

    if (stats.key_frame) {
      propose(image.height_px, proposals_, &stats.dropped_boxes);
    } else {
      proposals_ = tracked_;
    }
    tracked_.clear();
    stats.proposals = int(proposals_.size());
    stats.proposals_ms = float(stage.lap_ms());

    // Propagated boxes went through the box head in the frame before, so that this is their second pass.
    const float min_score = settings_.score_threshold;
    if (stats.key_frame && spec_.box_head.second_pass_threshold) {
      run_box_head(proposals_, std::min(min_score, *spec_.box_head.second_pass_threshold), found_,
                   &stats.dropped_boxes);
      proposals_.swap(found_);
    }
    run_box_head(proposals_, min_score, found_, &stats.dropped_boxes);
    stats.box_head_ms = float(stage.lap_ms());

    if (!found_.empty()) run_dense_head(found_, result);
  }
  stats.total_ms = float(total.lap_ms());
}

void DensePose::reset() {
  frames_since_key_ = 0;
  tracked_.clear();
}

void DensePose::run_trunk() {
  const int64_t height = input_.padded_height_px;
  const int64_t width = input_.padded_width_px;
  const auto cells = [](int64_t side, int stride) { return (side + stride - 1) / stride; };
  shapes_.clear();
  for (const int stride : spec_.rpn.strides) {
    shapes_.push_back({1, cells(height, stride), cells(width, stride), channels_});
  }
  inputs_.assign(1, {input_.values.data(), {1, 3, height, width}});
  pyramid_ = trunk_->run(inputs_, shapes_, cancel_.get());
  features_.clear();
  for (size_t l = 0; l < kFeatureLevels; ++l) {
    const TensorView& map = pyramid_[l];
    features_.push_back({map.data, channels_, int(map.shape[1]), int(map.shape[2]), spec_.box_head.strides[l]});
  }
}

void DensePose::propose(int image_height_px, std::vector<ScoredBox>& found, int* dropped) {
  rpn_levels_.assign(kRpnLevels, {});
  // Runs a graph of the RPN on `count` levels from `first` on.
  const auto run_rpn = [&](Session& rpn, size_t first, size_t count) {
    inputs_.assign(pyramid_.begin() + std::ptrdiff_t(first), pyramid_.begin() + std::ptrdiff_t(first + count));
    const int64_t anchors = int64_t(spec_.rpn.aspect_ratios.size());
    shapes_.clear();
    for (const TensorView& map : inputs_) shapes_.push_back({1, map.shape[1], map.shape[2], 5 * anchors});
    const std::vector<TensorView>& outputs = rpn.run(inputs_, shapes_, cancel_.get());
    for (size_t l = 0; l < count; ++l) {
      rpn_levels_[first + l] = {outputs[l].data, int(inputs_[l].shape[2]), int(inputs_[l].shape[1])};
    }
  };
  run_rpn(*rpn_coarse_, 1, kRpnLevels - 1);
  // The finest anchors are for boxes smaller than the geometric mean of their side and the next level's. A standing
  // person is about three times as high as wide, so that the box's side (root of its area) is height / sqrt(3).
  const float scale = float(input_.height_px) / float(image_height_px);
  const std::vector<float>& sizes = spec_.rpn.anchor_sizes_px;
  if (float(settings_.min_person_height_px) * scale < std::sqrt(3.0f * sizes[0] * sizes[1])) run_rpn(*rpn_fine_, 0, 1);
  select_proposals(rpn_levels_, spec_.rpn, settings_.max_proposals, float(input_.width_px), float(input_.height_px),
                   candidates_, found, dropped);
}

// The larger the box, the coarser the level (Lin et al., Feature Pyramid Networks, 2017, equation 1).
const FeatureMap& DensePose::level_for(const Box& box) const {
  const BoxHeadSpec& spec = spec_.box_head;
  const double level = std::floor(spec.canonical_level +
                                  std::log2(std::sqrt(double(box.area())) / double(spec.canonical_size_px) + 1e-8));
  const int slot = int(std::clamp(level, double(kFirstLevel), double(kFirstLevel + kFeatureLevels - 1))) - kFirstLevel;
  return features_[size_t(slot)];
}

void DensePose::run_box_head(const std::vector<ScoredBox>& boxes, float min_score, std::vector<ScoredBox>& found,
                             int* dropped) {
  found.clear();
  if (boxes.empty()) return;
  const BoxHeadSpec& spec = spec_.box_head;
  const int64_t count = int64_t(boxes.size());
  const size_t roi_size = size_t(channels_) * size_t(spec.pool_size) * size_t(spec.pool_size);
  rois_.resize(size_t(count) * roi_size);
  for (size_t i = 0; i < boxes.size(); ++i) {
    cancel_->check();
    roi_align_.run(level_for(boxes[i].box), boxes[i].box, spec.pool_size, rois_.data() + i * roi_size);
  }
  // Of each: logits of person and background, then dx, dy, dw, dh.
  inputs_.assign(1, {rois_.data(), {count, spec.pool_size, spec.pool_size, channels_}});
  shapes_.assign(1, {count, 6});
  const TensorView& outputs = box_head_->run(inputs_, shapes_, cancel_.get()).front();

  for (size_t i = 0; i < boxes.size(); ++i) {
    const float score = first_of_two(outputs.data + 6 * i);
    Box box = apply_deltas(boxes[i].box, outputs.data + 6 * i + 2, spec.delta_weights);
    if (std::isnan(score) || !clip_box(box, float(input_.width_px), float(input_.height_px))) {
      ++*dropped;
    } else if (score > min_score) {
      found.push_back({box, score, int64_t(i)});
    }
  }
  non_maximum_suppression(found, spec.nms_iou, size_t(settings_.max_people));
}

void DensePose::run_dense_head(const std::vector<ScoredBox>& people, DensePoseResult& result) {
  Stopwatch stage;
  const DenseHeadSpec& spec = spec_.dense_head;
  const int64_t count = int64_t(people.size());
  const size_t roi_size = size_t(channels_) * size_t(spec.pool_size) * size_t(spec.pool_size);
  rois_.resize(size_t(count) * roi_size);
  for (size_t i = 0; i < people.size(); ++i) {
    roi_align_.run(features_[0], people[i].box, spec.pool_size, rois_.data() + i * roi_size);
  }
  const int classes = spec.coarse_classes + spec.index_classes;
  inputs_.assign(1, {rois_.data(), {count, spec.pool_size, spec.pool_size, channels_}});
  shapes_.assign(2, {count, spec.pool_size, spec.pool_size, 4 * classes});
  shapes_[1][3] = charts_.channels();
  const std::vector<TensorView>& outputs = dense_head_->run(inputs_, shapes_, cancel_.get());
  result.stats.dense_head_ms = float(stage.lap_ms());

  const float scale_x = float(result.planes.width_px) / float(input_.width_px);
  const float scale_y = float(result.planes.height_px) / float(input_.height_px);
  const size_t labels_size = size_t(spec.output_size) * size_t(spec.output_size) * size_t(classes);
  const size_t surface_size = size_t(charts_.channels()) * size_t(spec.pool_size) * size_t(spec.pool_size);
  for (size_t i = 0; i < people.size(); ++i) {
    cancel_->check();
    if (settings_.surface) charts_.begin(outputs[1].data + i * surface_size, spec.pool_size);
    const DenseLogits logits{outputs[0].data + i * labels_size, settings_.surface ? &charts_ : nullptr,
                             spec.coarse_classes, spec.index_classes, spec.output_size};
    Box box = scaled(people[i].box, scale_x, scale_y);
    clip_box(box, float(result.planes.width_px), float(result.planes.height_px));
    const DecodeCounts counts = paint_person(logits, box, uint8_t(result.people.size() + 1), spec.mask_threshold,
                                             spec.min_visible_fraction, decode_memory_, result.planes);
    // A box without a body is a false alarm; one whose body is painted already shows the same person again.
    if (counts.body_pixels > 0) {
      result.people.push_back({box, people[i].score});
      tracked_.push_back(people[i]);
    }
    result.stats.decoded.body_pixels += counts.body_pixels;
    result.stats.decoded.clamped_uv += counts.clamped_uv;
  }
  result.stats.decode_ms = float(stage.lap_ms());
}

}  // namespace maq
