#include "densepose/densepose.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/error.h"

namespace maq {
namespace {

// The order in which the networks' outputs are asked for and found again.
const std::vector<std::string> kDetectorOutputs = {
    "p2",          "p3",          "p4",      "p5",      "objectness2", "objectness3", "objectness4",
    "objectness5", "objectness6", "deltas2", "deltas3", "deltas4",     "deltas5",     "deltas6"};
constexpr size_t kFeatureLevels = 4;
constexpr size_t kRpnLevels = 5;
constexpr size_t kFirstObjectness = kFeatureLevels;
constexpr size_t kFirstDeltas = kFirstObjectness + kRpnLevels;

class Stopwatch {
 public:
  // Milliseconds since it was made or last read.
  float lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const float ms = std::chrono::duration<float, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// The graph's spec with exactly these outputs, in this order; the manifest may list more, in any order.
GraphSpec with_outputs(const Manifest& manifest, const std::string& graph, const std::vector<std::string>& names) {
  GraphSpec spec = manifest.graphs.at(graph);
  std::vector<TensorSpec> outputs;
  for (const std::string& name : names) {
    const auto found = std::find_if(spec.outputs.begin(), spec.outputs.end(),
                                    [&](const TensorSpec& tensor) { return tensor.name == name; });
    if (found == spec.outputs.end()) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": graph ", graph, " lists no output ", name,
                  ". Export the bundle again.");
    }
    outputs.push_back(*found);
  }
  spec.outputs = std::move(outputs);
  return spec;
}

int feature_channels(const Manifest& manifest, const GraphSpec& detector) {
  const std::vector<Dimension>& shape = detector.outputs[0].shape;
  const int64_t* channels = shape.size() == 4 ? std::get_if<int64_t>(&shape[1]) : nullptr;
  if (channels == nullptr) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name,
                ": output p2 of the detector must have the shape [1, channels, h, w] with a number of channels. "
                "Export the bundle again.");
  }
  return int(*channels);
}

Box scaled(const Box& box, float x, float y) { return {box.x0 * x, box.y0 * y, box.x1 * x, box.y1 * y}; }

// Probability of the first of two classes; stable for every finite logit.
float first_of_two(const float* logits) { return 1.0f / (1.0f + std::exp(logits[1] - logits[0])); }

}  // namespace

DensePose::DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle,
                     const DensePoseSettings& settings)
    : manifest_(bundle.manifest), settings_(settings) {
  if (settings_.long_side_px == 0) settings_.long_side_px = manifest_.input.long_side_px;
  if (settings_.score_threshold < 0) settings_.score_threshold = manifest_.box_head.score_threshold;
  if (settings_.max_people == 0) settings_.max_people = manifest_.box_head.max_people;

  const auto make = [&](const std::string& graph, const std::vector<std::string>& outputs) {
    GraphSpec spec = with_outputs(manifest_, graph, outputs);
    if (graph == "detector") channels_ = feature_channels(manifest_, spec);
    const std::vector<uint8_t>& bytes = bundle.files.at(spec.file);
    const std::string name = bundle.folder + "/" + spec.file;
    return std::make_unique<Session>(runtime, bytes, std::move(spec), name, settings_.threads);
  };
  detector_ = make("detector", kDetectorOutputs);
  box_head_ = make("box_head", {"logits", "deltas"});
  dense_head_ = make("dense_head", {"coarse", "index", "u", "v"});
}

void DensePose::run(const ImageView& image, DensePoseResult& result) {
  Stopwatch total, stage;
  DensePoseStats& stats = result.stats;
  stats = {};
  result.people.clear();
  result.planes.reset(image.width_px, image.height_px);

  make_network_input(
      image, {settings_.long_side_px, manifest_.input.multiple_of, manifest_.input.mean, manifest_.input.std}, input_);
  stats.network_width_px = input_.width_px;
  stats.network_height_px = input_.height_px;
  stats.preprocess_ms = stage.lap_ms();

  const Pyramid pyramid = run_detector();
  stats.detector_ms = stage.lap_ms();

  const std::vector<ScoredBox> proposals = select_proposals(pyramid.rpn, manifest_.rpn, float(input_.width_px),
                                                            float(input_.height_px), &stats.dropped_boxes);
  stats.proposals = int(proposals.size());
  stats.proposals_ms = stage.lap_ms();

  const std::vector<ScoredBox> people =
      proposals.empty() ? proposals : run_box_head(pyramid, proposals, &stats.dropped_boxes);
  stats.box_head_ms = stage.lap_ms();

  if (!people.empty()) run_dense_head(pyramid, people, result);
  stats.total_ms = total.lap_ms();
}

DensePose::Pyramid DensePose::run_detector() {
  const int64_t height = input_.padded_height_px;
  const int64_t width = input_.padded_width_px;
  const auto cells = [](int64_t side, int stride) { return (side + stride - 1) / stride; };
  const std::vector<int>& strides = manifest_.rpn.strides;
  std::vector<std::vector<int64_t>> shapes;
  for (size_t l = 0; l < kFeatureLevels; ++l) {
    const int stride = manifest_.box_head.strides[l];
    shapes.push_back({1, channels_, cells(height, stride), cells(width, stride)});
  }
  for (const int64_t channels : {3, 12}) {
    for (const int stride : strides) shapes.push_back({1, channels, cells(height, stride), cells(width, stride)});
  }
  Pyramid pyramid{detector_->run(input_.values.data(), {1, 3, height, width}, shapes), {}, {}};
  for (size_t l = 0; l < kFeatureLevels; ++l) {
    const TensorView& map = pyramid.outputs[l];
    pyramid.features.push_back(
        {map.data, channels_, int(map.shape[2]), int(map.shape[3]), manifest_.box_head.strides[l]});
  }
  for (size_t l = 0; l < kRpnLevels; ++l) {
    const TensorView& objectness = pyramid.outputs[kFirstObjectness + l];
    pyramid.rpn.push_back(
        {objectness.data, pyramid.outputs[kFirstDeltas + l].data, int(objectness.shape[3]), int(objectness.shape[2])});
  }
  return pyramid;
}

// The larger the box, the coarser the level (Lin et al., Feature Pyramid Networks, 2017, equation 1).
const FeatureMap& DensePose::level_for(const Pyramid& pyramid, const Box& box) const {
  const BoxHeadSpec& spec = manifest_.box_head;
  const double level = std::floor(spec.canonical_level +
                                  std::log2(std::sqrt(double(box.area())) / double(spec.canonical_size_px) + 1e-8));
  const int first_level = 2;
  const int slot = int(std::clamp(level, double(first_level), double(first_level + kFeatureLevels - 1))) - first_level;
  return pyramid.features[size_t(slot)];
}

std::vector<ScoredBox> DensePose::run_box_head(const Pyramid& pyramid, const std::vector<ScoredBox>& proposals,
                                               int* dropped) {
  const BoxHeadSpec& spec = manifest_.box_head;
  const int64_t count = int64_t(proposals.size());
  const size_t roi_size = size_t(channels_) * size_t(spec.pool) * size_t(spec.pool);
  rois_.resize(size_t(count) * roi_size);
  for (size_t i = 0; i < proposals.size(); ++i) {
    roi_align(level_for(pyramid, proposals[i].box), proposals[i].box, spec.pool, rois_.data() + i * roi_size);
  }
  const NetworkOutputs outputs =
      box_head_->run(rois_.data(), {count, channels_, spec.pool, spec.pool}, {{count, 2}, {count, 4}});

  std::vector<ScoredBox> found;
  for (size_t i = 0; i < proposals.size(); ++i) {
    const float score = first_of_two(outputs[0].data + 2 * i);
    Box box = apply_deltas(proposals[i].box, outputs[1].data + 4 * i, spec.delta_weights);
    if (std::isnan(score) || !clip_box(box, float(input_.width_px), float(input_.height_px))) {
      ++*dropped;
    } else if (score > settings_.score_threshold) {
      found.push_back({box, score, int64_t(i)});
    }
  }
  return non_maximum_suppression(std::move(found), spec.nms_iou, size_t(settings_.max_people));
}

void DensePose::run_dense_head(const Pyramid& pyramid, const std::vector<ScoredBox>& people, DensePoseResult& result) {
  Stopwatch stage;
  const DenseHeadSpec& spec = manifest_.dense_head;
  const int64_t count = int64_t(people.size());
  const size_t roi_size = size_t(channels_) * size_t(spec.pool) * size_t(spec.pool);
  rois_.resize(size_t(count) * roi_size);
  for (size_t i = 0; i < people.size(); ++i) {
    roi_align(pyramid.features[0], people[i].box, spec.pool, rois_.data() + i * roi_size);
  }
  const std::vector<int64_t> coarse_shape = {count, spec.coarse_classes, spec.output, spec.output};
  const std::vector<int64_t> index_shape = {count, spec.index_classes, spec.output, spec.output};
  const NetworkOutputs outputs = dense_head_->run(rois_.data(), {count, channels_, spec.pool, spec.pool},
                                                  {coarse_shape, index_shape, index_shape, index_shape});
  result.stats.dense_head_ms = stage.lap_ms();

  const float scale_x = float(result.planes.width_px) / float(input_.width_px);
  const float scale_y = float(result.planes.height_px) / float(input_.height_px);
  const size_t plane = size_t(spec.output) * size_t(spec.output);
  for (size_t i = 0; i < people.size(); ++i) {
    const size_t coarse_offset = i * size_t(spec.coarse_classes) * plane;
    const size_t index_offset = i * size_t(spec.index_classes) * plane;
    const DenseLogits logits{outputs[0].data + coarse_offset,
                             outputs[1].data + index_offset,
                             outputs[2].data + index_offset,
                             outputs[3].data + index_offset,
                             spec.coarse_classes,
                             spec.index_classes,
                             spec.output};
    Box box = scaled(people[i].box, scale_x, scale_y);
    clip_box(box, float(result.planes.width_px), float(result.planes.height_px));
    const DecodeCounts counts = paint_person(logits, box, uint8_t(result.people.size() + 1), spec.mask_threshold,
                                             spec.least_own_share, result.planes);
    // A box without a body is a false alarm; one whose body is somebody else's already shows that person again.
    if (counts.body_pixels > 0) result.people.push_back({box, people[i].score});
    result.stats.decoded.body_pixels += counts.body_pixels;
    result.stats.decoded.clamped_uv += counts.clamped_uv;
  }
  result.stats.decode_ms = stage.lap_ms();
}

}  // namespace maq
