#include "densepose/densepose.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/error.h"
#include "core/rounding.h"
#include "core/trace/trace_section.h"
#include "densepose/detector/shown_people.h"
#include "nn/provider.h"

namespace maq {
namespace {

constexpr int kCropSidePx = 192;
constexpr double kFullCircle_rad = 2 * 3.14159265358979323846;
// Crops follow people who keep this fraction of their pixels.
constexpr double kMinKeptBody = 0.25;
// Fractions of a box's width and height, on each side.
constexpr float kSideMargin = 0.03f, kEndMargin = 0.05f;
// In a stream, edges of a region that move by less than this fraction of its long side stay.
constexpr float kSteadyRegionShift = 0.02f;

// Puts the bundle's values in place of zeros.
DensePoseSettings resolved(DensePoseSettings settings, const DensePoseSpec& spec) {
  if (settings.long_side_px == 0) settings.long_side_px = spec.long_side_px;
  if (settings.score_threshold < 0) settings.score_threshold = spec.box_head.score_threshold;
  if (settings.max_people == 0) settings.max_people = spec.box_head.max_people;
  if (settings.max_proposals == 0) settings.max_proposals = spec.rpn.post_nms_top_k;
  if (settings.crop_side_px == 0) settings.crop_side_px = kCropSidePx;
  settings.crop_side_px = round_up(settings.crop_side_px, spec.input.multiple_of);
  return settings;
}

// Returns the region that the dense head sees: wider than the box, which may cut off hair, hands or feet. Without the
// margin the painted heads had flat tops: their first row was .82 as wide as the head in the median, instead of .24.
Box region_of(const Box& box, const NetworkSize& input) {
  const float x = kSideMargin * box.width(), y = kEndMargin * box.height();
  Box region{box.x0 - x, box.y0 - y, box.x1 + x, box.y1 + y};
  clip_box(region, float(input.width_px), float(input.height_px));
  return region;
}

bool is_near(const Box& a, const Box& b) {
  const float shift =
      std::max({std::abs(a.x0 - b.x0), std::abs(a.y0 - b.y0), std::abs(a.x1 - b.x1), std::abs(a.y1 - b.y1)});
  return shift < kSteadyRegionShift * std::max(a.width(), a.height());
}

int long_side(const NetworkSize& size) { return std::max(size.width_px, size.height_px); }

Box scaled(const Box& box, float x, float y) { return {box.x0 * x, box.y0 * y, box.x1 * x, box.y1 * y}; }

// Returns the box halfway between the box head's box and the bounds of the body: nearer the true box than either.
Box between(const Box& a, const Box& b) {
  return {(a.x0 + b.x0) / 2, (a.y0 + b.y0) / 2, (a.x1 + b.x1) / 2, (a.y1 + b.y1) / 2};
}

}  // namespace

DensePose::DensePose(std::shared_ptr<const OnnxRuntimeLibrary> runtime, const Bundle& bundle,
                     const DensePoseSettings& settings)
    : spec_(read_densepose_spec(bundle.manifest)),
      measures_threads_(settings.threads == MAQ_THREADS_MEASURED),
      chooses_size_(settings.long_side_px == 0),
      settings_(resolved(settings, spec_)),
      full_{settings_.key_frame_interval, settings_.long_side_px},
      scales_(settings_.long_side_px),
      cancel_(std::make_unique<RunCancel>(runtime)),
      surface_(spec_.surface_file.empty() ? std::vector<uint8_t>() : bundle.files.at(spec_.surface_file),
               bundle.path_of(spec_.surface_file)),
      steady_surface_(settings_.steadiness),
      tracker_(size_t(settings_.max_people)) {
  SessionSettings on_provider;
  on_provider.threads = settings_.threads;
  on_provider.provider = available_provider(*runtime, settings_.provider);
  if (measures_threads_) {
    settings_.threads = Trunk::measured_threads(runtime, bundle, spec_, settings_.long_side_px, on_provider);
  }
  const DensePoseNetworks networks(std::move(runtime), bundle, settings_.threads, on_provider.provider);
  detector_ = std::make_unique<PersonDetector>(networks, spec_, settings_);
  const int channels = detector_->trunk().channels();
  mapper_ = std::make_unique<SurfaceMapper>(networks, spec_, "dense_head", spec_.charts_file, channels);
  crops_ = std::make_unique<CropPass>(networks, spec_, settings_, detector_->trunk(), *mapper_);
  if (settings_.keypoints) keypoints_ = std::make_unique<KeypointFinder>(networks, spec_, mapper_->chart_channels());
  if (spec_.dense_head.output_size != 2 * spec_.dense_head.pool_size) {
    throw Error(MAQ_ERROR_BAD_BUNDLE, "Bundle ", bundle.manifest.name, ": the dense head's output is ",
                spec_.dense_head.output_size, " cells wide, but must be twice its pool of ", spec_.dense_head.pool_size,
                ". Export the bundle again.");
  }
}

void DensePose::run(const ImageView& image, DensePoseResult& result, const StreamPlace& place) {
  is_stream_ = place.follows || settings_.key_frame_interval > 1;
  place_ = place;
  scales_.set_stream(is_stream_);
  try {
    map_image(image, result);
    cancel_->check();  // a later cancel() is for the next run
  } catch (...) {
    cancel_->reset();
    forget_frame();  // some of the frame's boxes may be missing
    throw;
  }
}

void DensePose::reset() {
  forget_frame();
  tracker_.begin_stream();
}

void DensePose::forget_frame() {
  frames_since_key_ = 0;
  tracked_.clear();
  tracks_crops_ = false;
  scales_.reset();
  is_forgotten_ = true;
}

void DensePose::set_quality(int key_frame_interval, int long_side_px) {
  if (long_side_px != settings_.long_side_px) forget_frame();  // boxes are followed in pixels of the network's input
  settings_.key_frame_interval = key_frame_interval;
  settings_.long_side_px = long_side_px;
}

void DensePose::begin_frame(const ImageView& image, DensePoseStats& stats) {
  const double roll_rad = std::remainder(double(roll_rad_.load()), kFullCircle_rad);
  const int roll_steps = int(std::lround(roll_rad / kRollStepRad));
  const bool is_same_stream =
      image.width_px == image_width_px_ && image.height_px == image_height_px_ && roll_steps == roll_steps_;
  if (!is_same_stream) {
    scales_.reset();
    tracked_.clear();
  }
  steady_surface_.begin(image, is_stream_ && is_same_stream && !is_forgotten_);
  is_forgotten_ = false;
  image_width_px_ = image.width_px;
  image_height_px_ = image.height_px;
  roll_steps_ = roll_steps;
  stats.key_frame = !is_same_stream || frames_since_key_ == 0;
  frames_since_key_ = stats.key_frame ? 1 : frames_since_key_ + 1;
  if (frames_since_key_ >= settings_.key_frame_interval) frames_since_key_ = 0;
  stats.threads = settings_.threads;
  stats.is_threads_measured = measures_threads_;
  stats.network_width_px = seen_.size.width_px;
  stats.network_height_px = seen_.size.height_px;
}

void DensePose::see(const ImageView& image, int long_side_px, DensePoseStats& stats) {
  seen_ = rotated_input(image.width_px, image.height_px, long_side_px, roll_steps_);
  stats.network_width_px = seen_.size.width_px;
  stats.network_height_px = seen_.size.height_px;
}

void DensePose::map_image(const ImageView& image, DensePoseResult& result) {
  cancel_->check();
  Stopwatch total;
  DensePoseStats& stats = result.stats;
  stats = {};
  result.people.clear();
  result.keypoints.clear();
  result.planes.reset(image.width_px, image.height_px);
  begin_frame(image, stats);

  mapped_.clear();
  if (!stats.key_frame && tracks_crops_) {
    mapped_.swap(tracked_);
    for (MappedPerson& person : mapped_) person.answer = {};  // of the previous frame
    const TraceSection trace("maquette crops");
    Stopwatch stage;
    stats.crops = crops_->run(image, mapped_, *cancel_, &stats.provider);
    if (stats.crops > 0) stats.crops_ms = float(stage.lap_ms());
  } else {
    mapper_->begin();
    if (stats.key_frame) {
      detect_people(image, stats);
    } else if (!tracked_.empty()) {  // else nothing runs until the next key frame
      follow_people(image, stats);
    }
    if (!mapped_.empty()) map_people(image, stats);
  }
  paint_people(result);
  find_keypoints(result);
  give_ids(image, result);
  stats.total_ms = float(total.lap_ms());
}

const std::vector<ScoredBox>& DensePose::run_detector(const ImageView& image, const std::vector<ScoredBox>* followed,
                                                      DensePoseStats& stats) {
  const float threshold = settings_.score_threshold;
  shown_boxes_.clear();
  if (is_stream_) {
    for (const MappedPerson& person : tracked_) shown_boxes_.push_back(person.box);
  }
  const float min_score = shown_boxes_.empty() ? threshold : kept_score(threshold);
  found_ = detector_->run(image, seen_, followed, crops_->min_box_score(min_score), *cancel_, stats);
  mark_shown(shown_boxes_, seen_.to_image, crops_->min_box_score(threshold), found_);
  return found_;
}

void DensePose::follow_people(const ImageView& image, DensePoseStats& stats) {
  tracked_boxes_.clear();
  for (const MappedPerson& person : tracked_) tracked_boxes_.push_back(person.found);
  add_people(image, run_detector(image, &tracked_boxes_, stats), nullptr);
}

void DensePose::detect_people(const ImageView& image, DensePoseStats& stats) {
  const int near_side = settings_.long_side_px;
  const bool is_full = settings_.key_frame_interval == full_.key_frame_interval && near_side == full_.long_side_px;
  const int far_side = chooses_size_ && is_full ? scales_.far_side_px(std::max(image.width_px, image.height_px),
                                                                      settings_.min_person_height_px)
                                                : 0;
  const bool runs_near = far_side == 0 || scales_.runs_near();
  if (runs_near) {
    see(image, near_side, stats);
    near_people_ = run_detector(image, nullptr, stats);
    add_people(image, near_people_, nullptr);
  }
  if (far_side == 0 || (runs_near && !scales_.runs_far(near_people_))) return;

  see(image, far_side, stats);
  const float to_near = float(near_side) / float(far_side);
  const std::vector<ScoredBox>& far_people = run_detector(image, nullptr, stats);
  if (runs_near) {
    select_people(near_people_, far_people, to_near, keeps_near_, keeps_far_);
    drop_people(keeps_near_);
    for (MappedPerson& person : mapped_) person.to_seen = 1 / to_near;
  }
  add_people(image, far_people, runs_near ? &keeps_far_ : nullptr);
  drop_beyond(size_t(settings_.max_people));
  all_people_.clear();
  for (const MappedPerson& person : mapped_) {
    const float scale = person.to_seen * to_near;
    all_people_.push_back({scaled(person.found.box, scale, scale), person.found.score});
  }
  scales_.judge(all_people_, runs_near);
}

void DensePose::add_people(const ImageView& image, const std::vector<ScoredBox>& found,
                           const std::vector<uint8_t>* keeps) {
  for (size_t i = 0; i < found.size(); ++i) {
    if (keeps != nullptr && (*keeps)[i] == 0) continue;
    const ScoredBox& person = found[i];
    const Box region = region_for(person.box);
    mapper_->add(detector_->trunk().features()[0], region);
    MappedPerson mapped;
    mapped.found = person;
    mapped.mapper = mapper_.get();
    mapped.input_region = region;
    mapped.input_side_px = long_side(seen_.size);
    if (seen_.roll_steps == 0) {
      mapped.box = scaled(person.box, float(seen_.to_image.xx), float(seen_.to_image.yy));
      clip_box(mapped.box, float(image.width_px), float(image.height_px));
      mapped.region = scaled(region, float(seen_.to_image.xx), float(seen_.to_image.yy));
    } else {  // the box comes from the painted body: around this one's corners it would be too large
      mapped.first_view = PersonCrop{seen_.to_image, seen_.to_image.inverse(), region, true};
    }
    mapped_.push_back(mapped);
  }
}

Box DensePose::region_for(const Box& box) const {
  const Box region = region_of(box, seen_.size);
  if (!is_stream_) return region;
  for (const MappedPerson& person : tracked_) {
    if (person.input_side_px == long_side(seen_.size) && is_near(region, person.input_region))
      return person.input_region;
  }
  return region;
}

void DensePose::drop_people(const std::vector<uint8_t>& keeps) {
  mapper_->drop(keeps);
  size_t kept = 0;
  for (size_t i = 0; i < mapped_.size(); ++i) {
    if (keeps[i] != 0) mapped_[kept++] = mapped_[i];
  }
  mapped_.resize(kept);
}

void DensePose::drop_beyond(size_t count) {
  while (mapped_.size() > count) {
    const auto by_score = [](const MappedPerson& a, const MappedPerson& b) { return a.found.score < b.found.score; };
    keeps_near_.assign(mapped_.size(), 1);
    keeps_near_[size_t(std::min_element(mapped_.begin(), mapped_.end(), by_score) - mapped_.begin())] = 0;
    drop_people(keeps_near_);
  }
}

void DensePose::map_people(const ImageView& image, DensePoseStats& stats) {
  Stopwatch stage;
  TraceSection trace("maquette dense head");
  mapper_->run(*cancel_);
  for (size_t i = 0; i < mapped_.size(); ++i) mapped_[i].answer = mapper_->answer(i);
  stats.dense_head_ms = float(stage.lap_ms());
  if (settings_.crops != PersonCrops::kOff) {
    trace.next("maquette crops");
    crops_->choose(mapped_, seen_.up, is_stream_ ? &tracked_ : nullptr);
    drop_unlikely();
    stats.crops = crops_->run(image, mapped_, *cancel_, &stats.provider);
    drop_unlikely();
    for (MappedPerson& person : mapped_) person.found.score = crops_->score_of(person);
    stats.crops_ms = float(stage.lap_ms());
  }
  sort_by_score();
  for (MappedPerson& person : mapped_) {
    person.found.box = scaled(person.found.box, person.to_seen, person.to_seen);
    person.to_seen = 1;
  }
}

void DensePose::drop_unlikely() {
  const auto is_unlikely = [&](const MappedPerson& person) {
    const float threshold = settings_.score_threshold;
    return crops_->score_of(person) <= (person.found.was_shown ? kept_score(threshold) : threshold);
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

void DensePose::paint_people(DensePoseResult& result) {
  Stopwatch stage;
  const TraceSection trace("maquette decode");
  const DenseHeadSpec& spec = spec_.dense_head;
  const bool ran_crops_alone = !result.stats.key_frame && tracks_crops_;
  tracked_.clear();
  tracks_crops_ = false;
  if (keypoints_ != nullptr) keypoints_->begin();
  if (mapped_.empty()) return;
  tracks_crops_ = settings_.key_frame_interval > 1 &&
                  std::all_of(mapped_.begin(), mapped_.end(), [](const MappedPerson& p) { return p.crop.has_value(); });
  for (MappedPerson& person : mapped_) {
    cancel_->check();
    DenseLogits logits = person.logits();
    if (!settings_.surface) logits.charts = nullptr;
    const uint8_t number = uint8_t(result.people.size() + 1);
    const PersonCrop* const view = person.crop ? &*person.crop : person.first_view ? &*person.first_view : nullptr;
    const AffineMap to_cells =
        view != nullptr ? view->to_cells(logits.size) : map_of_cells(person.region, logits.size).inverse();
    steady_surface_.steady(to_cells, logits, person.answer.labels, person.answer.surface,
                           person.mapper->chart_channels());
    const DecodeCounts counts = view != nullptr
                                    ? paint_rotated_person(logits, to_cells, number, spec.mask_threshold,
                                                           spec.min_visible_fraction, decode_memory_, result.planes)
                                    : paint_person(logits, person.region, number, spec.mask_threshold,
                                                   spec.min_visible_fraction, decode_memory_, result.planes);
    result.stats.decoded.body_pixels += counts.body_pixels - counts.won_pixels;
    result.stats.decoded.clamped_uv += counts.clamped_uv;
    // A box without a body is a false alarm; a box whose body is painted already shows the same person again.
    if (counts.body_pixels == 0) continue;
    if (view != nullptr) {
      Box body = person_bounds(logits.size, to_cells.inverse(), spec.mask_threshold, decode_memory_);
      clip_box(body, float(result.planes.width_px), float(result.planes.height_px));
      person.box = person.first_view ? body : between(person.box, body);
    }
    if (keypoints_ != nullptr) keypoints_->add(person.answer.surface, to_cells.inverse());
    const bool is_lost = double(counts.body_pixels) < kMinKeptBody * double(person.body_pixels);
    person.body_pixels = counts.body_pixels;
    if (is_stream_ && person.crop) {
      crops_->follow(person, !ran_crops_alone, result.planes.width_px, result.planes.height_px, decode_memory_);
    }
    result.people.push_back({person.box, person.found.score, 0});
    if (!(tracks_crops_ && is_lost)) tracked_.push_back(person);
  }
  result.stats.decode_ms = float(stage.lap_ms());
}

void DensePose::find_keypoints(DensePoseResult& result) {
  if (keypoints_ == nullptr || result.people.empty()) return;
  Stopwatch stage;
  const TraceSection trace("maquette keypoints");
  result.keypoints = keypoints_->run(*cancel_);
  result.stats.keypoints_ms = float(stage.lap_ms());
}

void DensePose::give_ids(const ImageView& image, DensePoseResult& result) {
  const TraceSection trace("maquette ids");
  if (!is_stream_) tracker_.begin_stream();
  painted_boxes_.clear();
  for (const Person& person : result.people) painted_boxes_.push_back(person.box);
  const std::vector<int64_t>& ids = tracker_.update(image, result.planes, painted_boxes_, place_.time_ns);
  for (size_t i = 0; i < ids.size(); ++i) result.people[i].id = ids[i];
}

}  // namespace maq
