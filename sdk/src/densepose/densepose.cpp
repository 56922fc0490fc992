#include "densepose/densepose.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "core/rounding.h"
#include "core/trace/trace_section.h"
#include "nn/provider.h"
#include "nn/thread_choice.h"

namespace maq {
namespace {

constexpr size_t kFeatureLevels = 4;  // P2 to P5, which the heads read
constexpr size_t kRpnLevels = 5;      // P2 to P6
constexpr int kFirstLevel = 2;
constexpr char kEvidence[] = "person";  // output of the trunk
// People gain by a crop whose box has a shorter long side, in pixels of the network's input, or who lean by more.
constexpr float kSmallPersonPx = 150;
constexpr double kMinLeanDegrees = 15;
constexpr int kCropSidePx = 192;
constexpr double kFullCircle_rad = 2 * 3.14159265358979323846;
constexpr size_t kSizedTrunks = 2;  // kept: of frames and of crops
// In crops people are followed who move by less than this, of their long side, from frame to frame; and who keep this
// fraction of their pixels.
constexpr double kMotionMargin = 0.05;
constexpr double kMinKeptBody = 0.25;
// How much less confident than the first answer, in mean probability of the part, that of a crop may be. Measured on
// renderings and photographs: what crops cost some people, large ones in groups above all, is less with it.
constexpr float kMaxLostConfidence = 0.1f;
// With crops a person's score counts how sure the parts are: the odds of the box head are multiplied by those of that
// mean probability, over the odds of kNeutralConfidence. So people are looked at whose boxes alone, by a factor of
// kMaxGainedOdds, would not be shown. Chosen on renderings and photographs of the validation split.
constexpr float kNeutralConfidence = 0.4f, kMaxGainedOdds = 3.5f;

// Settings with the bundle's values in place of zeros.
DensePoseSettings resolved(DensePoseSettings settings, const DensePoseSpec& spec) {
  if (settings.long_side_px == 0) settings.long_side_px = spec.long_side_px;
  if (settings.score_threshold < 0) settings.score_threshold = spec.box_head.score_threshold;
  if (settings.max_people == 0) settings.max_people = spec.box_head.max_people;
  if (settings.max_proposals == 0) settings.max_proposals = spec.rpn.post_nms_top_k;
  if (settings.crop_side_px == 0) settings.crop_side_px = kCropSidePx;
  settings.crop_side_px = round_up(settings.crop_side_px, spec.input.multiple_of);
  return settings;
}

Box scaled(const Box& box, float x, float y) { return {box.x0 * x, box.y0 * y, box.x1 * x, box.y1 * y}; }

// Half-way between the box head's box and the bounds of the body: nearer the true box than either.
Box between(const Box& a, const Box& b) {
  return {(a.x0 + b.x0) / 2, (a.y0 + b.y0) / 2, (a.x1 + b.x1) / 2, (a.y1 + b.y1) / 2};
}

float odds(float probability) {
  const float inside = std::clamp(probability, 1e-4f, 1 - 1e-4f);
  return inside / (1 - inside);
}
float probability(float odds) { return odds / (1 + odds); }

// Stable for every finite logit.
float logistic(float logit) { return 1.0f / (1.0f + std::exp(-logit)); }

}  // namespace

DensePose::DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle,
                     const DensePoseSettings& settings)
    : spec_(read_densepose_spec(bundle.manifest)),
      measures_threads_(settings.threads == MAQ_THREADS_MEASURED),
      settings_(resolved(settings, spec_)),
      charts_(bundle.files.at(spec_.charts_file), spec_.dense_head.index_classes - 1,
              bundle.path_of(spec_.charts_file)),
      surface_(spec_.surface_file.empty() ? std::vector<uint8_t>() : bundle.files.at(spec_.surface_file),
               bundle.path_of(spec_.surface_file)) {
  cancel_ = std::make_unique<RunCancel>(runtime);
  const Manifest& manifest = bundle.manifest;
  const int first = kFirstLevel, last = kFirstLevel + int(kRpnLevels) - 1;
  std::vector<std::string> maps = at_levels("p", first, last);
  if (spec_.box_head.evidence_stride > 0) maps.push_back(kEvidence);
  const GraphSpec trunk = graph_with(manifest, "trunk", {"image"}, maps);
  channels_ = feature_channels(trunk, manifest.name);
  SessionSettings on_provider{settings_.threads, settings_.spin};
  on_provider.provider = available_provider(*runtime, settings_.provider);
  if (measures_threads_) {
    on_provider.threads = settings_.threads = measured_threads(runtime, bundle, trunk, on_provider);
  }
  const SessionSettings on_cpu{settings_.threads, settings_.spin};
  // A graph, whose inputs and outputs have these shapes.
  const auto make_checked = [&](const std::string& name, GraphSpec graph, const std::vector<int64_t>& input,
                                const std::vector<std::vector<int64_t>>& outputs, const SessionSettings& with) {
    require_shapes(graph, input, outputs, concatenate("Bundle ", manifest.name, ": graph ", name, ": "));
    return std::make_unique<Session>(runtime, bundle.files.at(graph.file), graph, bundle.path_of(graph.file), with);
  };
  const std::vector<int64_t> features = {1, kAnySize, kAnySize, channels_};
  std::vector<std::vector<int64_t>> trunk_outputs(kRpnLevels, features);
  trunk_outputs.push_back({1, kAnySize, kAnySize, 1});  // the evidence
  trunk_ = make_checked("trunk", trunk, {1, 3, kAnySize, kAnySize}, trunk_outputs, on_cpu);
  const std::vector<int64_t> anchors = {1, kAnySize, kAnySize, 5 * int64_t(spec_.rpn.aspect_ratios.size())};
  rpn_fine_ = make_checked(
      "rpn_fine", graph_with(manifest, "rpn_fine", at_levels("p", first, first), at_levels("rpn", first, first)),
      features, {anchors}, on_cpu);
  rpn_coarse_ = make_checked(
      "rpn_coarse",
      graph_with(manifest, "rpn_coarse", at_levels("p", first + 1, last), at_levels("rpn", first + 1, last)), features,
      {anchors}, on_cpu);
  const int64_t box_pool = spec_.box_head.pool_size, dense_pool = spec_.dense_head.pool_size;
  box_head_ = make_checked("box_head", graph_with(manifest, "box_head", {"rois"}, {"boxes"}),
                           {kAnySize, box_pool, box_pool, channels_}, {{kAnySize, 6}}, on_provider);
  const int64_t classes = spec_.dense_head.coarse_classes + spec_.dense_head.index_classes;
  const auto make_dense_head = [&](const std::string& name) {
    return make_checked(
        name, graph_with(manifest, name, {"rois"}, {"labels", "surface"}),
        {kAnySize, dense_pool, dense_pool, channels_},
        {{kAnySize, dense_pool, dense_pool, 4 * classes}, {kAnySize, dense_pool, dense_pool, charts_.channels()}},
        on_provider);
  };
  dense_head_ = make_dense_head("dense_head");
  // Null on the CPU.
  const auto make_sized = [&](const GraphSpec& graph, std::vector<uint8_t>& bytes,
                              std::optional<SizedSessions>& made) -> SizedSessions* {
    if (on_provider.provider == MAQ_PROVIDER_CPU) return nullptr;
    bytes = bundle.files.at(graph.file);
    return &made.emplace(runtime, bytes, graph, bundle.path_of(graph.file), on_provider, kSizedTrunks);
  };
  SizedSessions* const sized_trunk = make_sized(trunk, trunk_bytes_, sized_trunk_);
  whole_ = crops_ = {trunk_.get(), sized_trunk, dense_head_.get(), &charts_, kRpnLevels};
  if (!spec_.crop_charts_file.empty() && settings_.crops != PersonCrops::kOff) {
    const GraphSpec crop_trunk = graph_with(manifest, "crop_trunk", {"image"}, {"p2"});
    crop_trunk_ = make_checked("crop_trunk", crop_trunk, {1, 3, kAnySize, kAnySize}, {features}, on_cpu);
    crop_dense_head_ = make_dense_head("crop_dense_head");
    crop_charts_.emplace(bundle.files.at(spec_.crop_charts_file), spec_.dense_head.index_classes - 1,
                         bundle.path_of(spec_.crop_charts_file));
    if (crop_charts_->channels() != charts_.channels()) {
      throw Error(MAQ_ERROR_BAD_BUNDLE, bundle.path_of(spec_.crop_charts_file), " is for ", crop_charts_->channels(),
                  " channels, but ", spec_.charts_file, " for ", charts_.channels(), ". Export the bundle again.");
    }
    SizedSessions* const sized = make_sized(crop_trunk, crop_trunk_bytes_, sized_crop_trunk_);
    crops_ = {crop_trunk_.get(), sized, crop_dense_head_.get(), &*crop_charts_, 1};
  }
  if (spec_.dense_head.output_size != 2 * spec_.dense_head.pool_size) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", manifest.name, ": the dense head's output is ",
                spec_.dense_head.output_size, " cells wide, but must be twice its pool of ", spec_.dense_head.pool_size,
                ". Export the bundle again.");
  }
}

void DensePose::run(const ImageView& image, DensePoseResult& result) {
  try {
    find_people(image, result);
    cancel_->check();  // one that comes later is of the next run
  } catch (...) {
    cancel_->reset();
    reset();  // of the frame's boxes, some may be missing
    throw;
  }
}

void DensePose::find_people(const ImageView& image, DensePoseResult& result) {
  cancel_->check();
  Stopwatch total;
  DensePoseStats& stats = result.stats;
  stats = {};
  result.people.clear();
  result.planes.reset(image.width_px, image.height_px);

  const double roll_rad = std::remainder(double(roll_rad_.load()), kFullCircle_rad);
  const int roll_steps = int(std::lround(roll_rad / kRollStepRad));
  const bool is_same_stream =
      image.width_px == image_width_px_ && image.height_px == image_height_px_ && roll_steps == seen_.roll_steps;
  image_width_px_ = image.width_px;
  image_height_px_ = image.height_px;
  stats.key_frame = !is_same_stream || frames_since_key_ == 0;
  frames_since_key_ = stats.key_frame ? 1 : frames_since_key_ + 1;
  if (frames_since_key_ >= settings_.key_frame_interval) frames_since_key_ = 0;
  seen_ = rotated_input(image.width_px, image.height_px, settings_.long_side_px, roll_steps);
  stats.threads = settings_.threads;
  stats.is_threads_measured = measures_threads_;
  stats.network_width_px = seen_.size.width_px;
  stats.network_height_px = seen_.size.height_px;

  mapped_.clear();
  if (!stats.key_frame && tracks_crops_) {
    mapped_.swap(tracked_);
    for (MappedPerson& person : mapped_) person.labels = person.surface = nullptr;  // of the frame before
    const TraceSection trace("maquette crops");
    run_crops(image, stats);
  } else if (stats.key_frame || !tracked_.empty()) {  // else nothing runs until the next key frame
    find_boxes(image, stats);
    if (!found_.empty()) map_people(image, result.planes, stats);
  }
  paint_people(result);
  stats.total_ms = float(total.lap_ms());
}

void DensePose::find_boxes(const ImageView& image, DensePoseStats& stats) {
  Stopwatch stage;
  TraceSection trace("maquette resize");
  const NetworkSize padded{round_up(seen_.size.width_px, spec_.input.multiple_of),
                           round_up(seen_.size.height_px, spec_.input.multiple_of)};
  const bool is_rotated = seen_.roll_steps != 0;
  if (is_rotated) {
    make_crop_input(image, seen_.to_image, padded, spec_.input, crop_input_);
  } else {
    make_network_input(image, seen_.size, spec_.input, input_);
  }
  stats.preprocess_ms = float(stage.lap_ms());

  trace.next("maquette detector");
  const std::vector<float>& values = is_rotated ? crop_input_.values : input_.values;
  stats.provider = run_trunk(whole_, values, padded.width_px, padded.height_px);
  stats.trunk_ms = float(stage.lap_ms());

  trace.next("maquette boxes");
  if (stats.key_frame) {
    propose(proposals_, &stats.dropped_boxes);
  } else {
    proposals_.clear();
    for (const MappedPerson& person : tracked_) proposals_.push_back(person.found);
  }
  stats.proposals = int(proposals_.size());
  stats.proposals_ms = float(stage.lap_ms());

  // Propagated boxes went through the box head in the frame before, so that this is their second pass.
  float min_score = settings_.score_threshold;
  if (settings_.crops != PersonCrops::kOff) {
    min_score = std::min(min_score, probability(odds(min_score) / kMaxGainedOdds));
  }
  if (stats.key_frame && spec_.box_head.second_pass_threshold) {
    run_box_head(proposals_, std::min(min_score, *spec_.box_head.second_pass_threshold), found_, &stats.dropped_boxes);
    proposals_.swap(found_);
  }
  run_box_head(proposals_, min_score, found_, &stats.dropped_boxes);
  stats.box_head_ms = float(stage.lap_ms());
}

void DensePose::reset() {
  frames_since_key_ = 0;
  tracked_.clear();
  tracks_crops_ = false;
}

void DensePose::set_quality(int key_frame_interval, int long_side_px) {
  if (long_side_px != settings_.long_side_px) reset();  // boxes are followed in pixels of the network's input
  settings_.key_frame_interval = key_frame_interval;
  settings_.long_side_px = long_side_px;
}

void DensePose::set_level_shapes(int width_px, int height_px, size_t levels) {
  shapes_.clear();
  for (size_t l = 0; l < levels; ++l) {
    const int stride = spec_.rpn.strides[l];
    shapes_.push_back({1, divide_up(height_px, stride), divide_up(width_px, stride), channels_});
  }
  const int stride = spec_.box_head.evidence_stride;
  if (levels == kRpnLevels && stride > 0) {
    shapes_.push_back({1, divide_up(height_px, stride), divide_up(width_px, stride), 1});
  }
}

int DensePose::measured_threads(const std::shared_ptr<const OnnxRuntimeLibrary>& runtime, const Bundle& bundle,
                                const GraphSpec& trunk, SessionSettings settings) {
  // Of a frame as most cameras give it, 4 to 3.
  const int width = round_up(settings_.long_side_px, spec_.input.multiple_of);
  const int height = round_up(3 * settings_.long_side_px / 4, spec_.input.multiple_of);
  set_level_shapes(width, height, kRpnLevels);
  return measure_threads(
      runtime,
      {bundle.files.at(trunk.file), trunk, bundle.path_of(trunk.file), width, height, {1, 3, height, width}, shapes_},
      std::move(settings));
}

maq_provider DensePose::run_trunk(const Mapper& mapper, const std::vector<float>& values, int width_px, int height_px) {
  set_level_shapes(width_px, height_px, mapper.levels);
  inputs_.assign(1, {values.data(), {1, 3, height_px, width_px}});
  Session& trunk = mapper.sized_trunk == nullptr ? *mapper.trunk : mapper.sized_trunk->at(width_px, height_px);
  pyramid_ = trunk.run(inputs_, shapes_, cancel_.get());
  features_.clear();
  for (size_t l = 0; l < std::min(mapper.levels, kFeatureLevels); ++l) {
    const TensorView& map = pyramid_[l];
    features_.push_back({map.data, channels_, int(map.shape[1]), int(map.shape[2]), spec_.box_head.strides[l]});
  }
  evidence_ = {};
  if (pyramid_.size() > kRpnLevels) {
    const TensorView& map = pyramid_[kRpnLevels];
    evidence_ = {map.data, 1, int(map.shape[1]), int(map.shape[2]), spec_.box_head.evidence_stride};
  }
  return trunk.provider();
}

void DensePose::propose(std::vector<ScoredBox>& found, int* dropped) {
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
  const float scale = float(1 / std::hypot(seen_.to_image.xy, seen_.to_image.yy));
  const std::vector<float>& sizes = spec_.rpn.anchor_sizes_px;
  if (float(settings_.min_person_height_px) * scale < std::sqrt(3.0f * sizes[0] * sizes[1])) run_rpn(*rpn_fine_, 0, 1);
  select_proposals(rpn_levels_, spec_.rpn, settings_.max_proposals, float(seen_.size.width_px),
                   float(seen_.size.height_px), candidates_, found, dropped);
}

// The larger the box, the coarser the level (Lin et al., Feature Pyramid Networks, 2017, equation 1).
const FeatureMap& DensePose::level_for(const Box& box) const {
  const BoxHeadSpec& spec = spec_.box_head;
  const double level = std::floor(spec.canonical_level +
                                  std::log2(std::sqrt(double(box.area())) / double(spec.canonical_size_px) + 1e-8));
  const int slot = int(std::clamp(level, double(kFirstLevel), double(kFirstLevel + kFeatureLevels - 1))) - kFirstLevel;
  return features_[size_t(slot)];
}

float DensePose::evidence_in(const Box& box) {
  float mean = 0;
  if (evidence_.data != nullptr) roi_align_.run(evidence_, box, 1, &mean);
  return mean;
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
    const float* logits = outputs.data + 6 * i;
    const float score = logistic(logits[0] - logits[1] + evidence_in(boxes[i].box));
    Box box = apply_deltas(boxes[i].box, outputs.data + 6 * i + 2, spec.delta_weights);
    if (std::isnan(score) || !clip_box(box, float(seen_.size.width_px), float(seen_.size.height_px))) {
      ++*dropped;
    } else if (score > min_score) {
      found.push_back({box, score, int64_t(i)});
    }
  }
  non_maximum_suppression(found, spec.nms_iou, size_t(settings_.max_people));
}

void DensePose::map_people(const ImageView& image, const DensePlanes& planes, DensePoseStats& stats) {
  Stopwatch stage;
  TraceSection trace("maquette dense head");
  const DenseHeadSpec& spec = spec_.dense_head;
  rois_.resize(found_.size() * dense_roi_size());
  for (const ScoredBox& person : found_) {
    roi_align_.run(features_[0], person.box, spec.pool_size, rois_.data() + mapped_.size() * dense_roi_size());
    MappedPerson mapped;
    mapped.found = person;
    if (seen_.roll_steps == 0) {
      mapped.box = scaled(person.box, float(seen_.to_image.xx), float(seen_.to_image.yy));
      clip_box(mapped.box, float(planes.width_px), float(planes.height_px));
    } else {  // the box comes from what is painted: around this one's corners it would be too large
      mapped.first_view = PersonCrop{seen_.to_image, seen_.to_image.inverse(), person.box, true};
    }
    mapped_.push_back(mapped);
  }
  const std::vector<TensorView>& answers = run_dense_head(whole_, found_.size());
  for (size_t i = 0; i < mapped_.size(); ++i) {
    mapped_[i].labels = answers[0].data + i * labels_size();
    mapped_[i].surface = answers[1].data + i * surface_size();
    mapped_[i].charts = &charts_;
  }
  stats.dense_head_ms = float(stage.lap_ms());
  if (settings_.crops == PersonCrops::kOff) return;
  trace.next("maquette crops");
  choose_crops();
  drop_unlikely();
  run_crops(image, stats);
  drop_unlikely();
  for (MappedPerson& person : mapped_) person.found.score = score_with_confidence(person);
  sort_by_score();
  stats.crops_ms = float(stage.lap_ms());
}

size_t DensePose::dense_roi_size() const {
  return size_t(channels_) * size_t(spec_.dense_head.pool_size) * size_t(spec_.dense_head.pool_size);
}

size_t DensePose::labels_size() const {
  const DenseHeadSpec& spec = spec_.dense_head;
  return size_t(spec.output_size) * size_t(spec.output_size) * size_t(spec.coarse_classes + spec.index_classes);
}

size_t DensePose::surface_size() const {
  const DenseHeadSpec& spec = spec_.dense_head;
  return size_t(charts_.channels()) * size_t(spec.pool_size) * size_t(spec.pool_size);
}

const std::vector<TensorView>& DensePose::run_dense_head(const Mapper& mapper, size_t count) {
  const DenseHeadSpec& spec = spec_.dense_head;
  const int64_t people = int64_t(count);
  inputs_.assign(1, {rois_.data(), {people, spec.pool_size, spec.pool_size, channels_}});
  shapes_.assign(2, {people, spec.pool_size, spec.pool_size, 4 * (spec.coarse_classes + spec.index_classes)});
  shapes_[1][3] = charts_.channels();
  return mapper.dense_head->run(inputs_, shapes_, cancel_.get());
}

DenseLogits DensePose::logits_of(const MappedPerson& person) {
  const DenseHeadSpec& spec = spec_.dense_head;
  person.charts->begin(person.surface, spec.pool_size);
  return {person.labels, person.charts, spec.coarse_classes, spec.index_classes, spec.output_size};
}

void DensePose::choose_crops() {
  const float threshold = spec_.dense_head.mask_threshold;
  for (MappedPerson& person : mapped_) {
    const DenseLogits logits = logits_of(person);
    classify_cells(logits, decode_memory_);
    person.confidence = part_confidence(logits, threshold, decode_memory_);
    const AffineMap cells =
        person.first_view ? person.first_view->to_cells(logits.size).inverse() : map_of_cells(person.box, logits.size);
    const auto axis = find_body_axis(logits, cells, threshold, decode_memory_);
    const PersonCrop crop = crop_around_person(logits.size, cells, axis.value_or(seen_.up), threshold, 0,
                                               settings_.crop_side_px, decode_memory_);
    const bool is_small = std::max(person.found.box.width(), person.found.box.height()) < kSmallPersonPx;
    if (settings_.crops == PersonCrops::kAll || leans(axis, kMinLeanDegrees, seen_.up) || is_small) person.crop = crop;
  }
}

float DensePose::score_with_confidence(const MappedPerson& person) const {
  return probability(odds(person.found.score) * odds(person.confidence) / odds(kNeutralConfidence));
}

void DensePose::drop_unlikely() {
  const auto is_unlikely = [&](const MappedPerson& person) {
    return score_with_confidence(person) <= settings_.score_threshold;
  };
  mapped_.erase(std::remove_if(mapped_.begin(), mapped_.end(), is_unlikely), mapped_.end());
}

void DensePose::sort_by_score() {
  for (size_t i = 1; i < mapped_.size(); ++i) {  // few, nearly in order; nothing from the heap
    for (size_t k = i; k > 0 && mapped_[k - 1].found.score < mapped_[k].found.score; --k) {
      std::swap(mapped_[k - 1], mapped_[k]);
    }
  }
}

void DensePose::run_crops(const ImageView& image, DensePoseStats& stats) {
  Stopwatch stage;
  const auto has_crop = [](const MappedPerson& person) { return person.crop.has_value(); };
  const size_t count = size_t(std::count_if(mapped_.begin(), mapped_.end(), has_crop));
  stats.crops = int(count);
  if (count == 0) return;
  // The dense head's memory is needed again.
  const size_t answer_size = labels_size() + surface_size();
  first_answers_.resize(mapped_.size() * answer_size);
  rois_.resize(count * dense_roi_size());
  const int side = settings_.crop_side_px;
  float* roi = rois_.data();
  for (size_t i = 0; i < mapped_.size(); ++i) {
    MappedPerson& person = mapped_[i];
    if (person.labels != nullptr) {
      float* const labels = first_answers_.data() + i * answer_size;
      float* const surface = std::copy_n(person.labels, labels_size(), labels);
      std::copy_n(person.surface, surface_size(), surface);
      person.labels = labels;
      person.surface = surface;
    }
    if (!person.crop) continue;
    make_crop_input(image, person.crop->to_image, {side, side}, spec_.input, crop_input_);
    stats.provider = run_trunk(crops_, crop_input_.values, side, side);
    roi_align_.run(features_[0], person.crop->box, spec_.dense_head.pool_size, roi);
    roi += dense_roi_size();
  }
  const std::vector<TensorView>& answers = run_dense_head(crops_, count);
  const float *labels = answers[0].data, *surface = answers[1].data;
  for (MappedPerson& person : mapped_) {
    if (!person.crop) continue;
    MappedPerson again = person;
    again.labels = labels;
    again.surface = surface;
    again.charts = crops_.charts;
    labels += labels_size();
    surface += surface_size();
    if (person.labels != nullptr) {
      const DenseLogits logits = logits_of(again);
      classify_cells(logits, decode_memory_);
      const float confidence = part_confidence(logits, spec_.dense_head.mask_threshold, decode_memory_);
      if (confidence < person.confidence - kMaxLostConfidence) {
        again = person;
        again.crop.reset();
      } else {
        again.confidence = confidence;
      }
    }
    person = again;
  }
  stats.crops_ms = float(stage.lap_ms());
}

void DensePose::paint_people(DensePoseResult& result) {
  Stopwatch stage;
  const TraceSection trace("maquette decode");
  const DenseHeadSpec& spec = spec_.dense_head;
  tracked_.clear();
  tracks_crops_ = false;
  if (mapped_.empty()) return;
  tracks_crops_ = settings_.key_frame_interval > 1 &&
                  std::all_of(mapped_.begin(), mapped_.end(), [](const MappedPerson& p) { return p.crop.has_value(); });
  for (MappedPerson& person : mapped_) {
    cancel_->check();
    DenseLogits logits = logits_of(person);
    if (!settings_.surface) logits.charts = nullptr;
    const uint8_t number = uint8_t(result.people.size() + 1);
    const PersonCrop* const place = person.crop ? &*person.crop : person.first_view ? &*person.first_view : nullptr;
    const DecodeCounts counts =
        place != nullptr ? paint_rotated_person(logits, place->to_cells(logits.size), number, spec.mask_threshold,
                                                spec.min_visible_fraction, decode_memory_, result.planes)
                         : paint_person(logits, person.box, number, spec.mask_threshold, spec.min_visible_fraction,
                                        decode_memory_, result.planes);
    result.stats.decoded.body_pixels += counts.body_pixels;
    result.stats.decoded.clamped_uv += counts.clamped_uv;
    // A box without a body is a false alarm; one whose body is painted already shows the same person again.
    if (counts.body_pixels == 0) continue;
    if (place != nullptr) {
      Box body =
          person_bounds(logits.size, place->to_cells(logits.size).inverse(), spec.mask_threshold, decode_memory_);
      clip_box(body, float(result.planes.width_px), float(result.planes.height_px));
      person.box = person.first_view ? body : between(person.box, body);
    }
    const bool is_lost = double(counts.body_pixels) < kMinKeptBody * double(person.body_pixels);
    person.body_pixels = counts.body_pixels;
    if (tracks_crops_) follow_in_crop(person, result);
    result.people.push_back({person.box, person.found.score});
    if (!(tracks_crops_ && is_lost)) tracked_.push_back(person);
  }
  result.stats.decode_ms = float(stage.lap_ms());
}

void DensePose::follow_in_crop(MappedPerson& person, const DensePoseResult& result) {
  const float threshold = spec_.dense_head.mask_threshold;
  const DenseLogits logits = logits_of(person);
  const AffineMap cells = person.crop->to_cells(logits.size).inverse();
  Box bounds = person_bounds(logits.size, cells, threshold, decode_memory_);
  if (result.stats.key_frame) {
    person.beyond_body = {person.box.x0 - bounds.x0, person.box.y0 - bounds.y0, person.box.x1 - bounds.x1,
                          person.box.y1 - bounds.y1};
  } else {  // the box head has not seen the person in this frame
    bounds = {bounds.x0 + person.beyond_body.x0, bounds.y0 + person.beyond_body.y0, bounds.x1 + person.beyond_body.x1,
              bounds.y1 + person.beyond_body.y1};
    if (clip_box(bounds, float(result.planes.width_px), float(result.planes.height_px))) person.box = bounds;
  }
  const auto axis = find_body_axis(logits, cells, threshold, decode_memory_);
  person.crop = crop_around_person(logits.size, cells, axis.value_or(seen_.up), threshold, kMotionMargin,
                                   settings_.crop_side_px, decode_memory_);
}

}  // namespace maq
