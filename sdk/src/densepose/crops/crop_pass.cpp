#include "densepose/crops/crop_pass.h"

#include <algorithm>

#include "core/error.h"

namespace maq {
namespace {

// People gain by a crop whose box has a shorter long side, in pixels of the network's input, or who lean by more.
constexpr float kSmallPersonPx = 150;
constexpr double kMinLeanDegrees = 15;
// A person who had a crop in the previous frame keeps one up to these limits.
constexpr float kSmallKeptPx = 165;
constexpr double kMinLeanKeptDegrees = 12;
// The first answer may cut people off: the region of a crop is wider on each side by this fraction of its long side.
constexpr double kCropMargin = 0.03;
// Crops follow people who move by less than this fraction of their long side from frame to frame.
constexpr double kMotionMargin = 0.05;
// The answer of a crop may be less confident than the first one by this mean probability of the part. Measured on
// renderings and photographs: some people, mostly large ones in groups, lose less by crops with this limit.
constexpr float kMaxLostConfidence = 0.1f, kMaxLostByKept = 0.2f;  // the second for people who had a crop before
// A crop stays while the corners of the person's box move by less than this fraction of its side: by the surface in the
// crop, and by the first answer, which is coarser.
constexpr double kSteadyShift = 0.03, kSteadyShiftOfFirst = 0.08;
// The bounds of one person in two frames of a stream overlap by this IoU.
constexpr float kSameBodyIou = 0.5f;
// With crops a person's score includes the confidence of the parts: the odds of the box head are multiplied by the odds
// of the mean probability, over the odds of kNeutralConfidence. So boxes count whose own odds are below the threshold
// by a factor of kMaxGainedOdds. Chosen on renderings and photographs of the validation split.
constexpr float kNeutralConfidence = 0.4f, kMaxGainedOdds = 3.5f;

float odds(float probability) {
  const float inside = std::clamp(probability, 1e-4f, 1 - 1e-4f);
  return inside / (1 - inside);
}
float probability(float odds) { return odds / (1 + odds); }

// Returns the person of the previous frame at the same place; nullptr if there is none.
const MappedPerson* find_same(const std::vector<MappedPerson>& previous, const Box& body) {
  const MappedPerson* same = nullptr;
  float best = kSameBodyIou;
  for (const MappedPerson& person : previous) {
    const float iou = overlap(person.body, body);
    if (iou > best) same = &person, best = iou;
  }
  return same;
}

bool has_crop_networks(const DensePoseSpec& spec, const DensePoseSettings& settings) {
  return !spec.crop_charts_file.empty() && settings.crops != PersonCrops::kOff;
}

}  // namespace

CropPass::CropPass(const DensePoseNetworks& networks, const DensePoseSpec& spec, const DensePoseSettings& settings,
                   Trunk& trunk, SurfaceMapper& mapper)
    : spec_(spec),
      settings_(settings),
      own_trunk_(has_crop_networks(spec, settings) ? std::make_unique<Trunk>(networks, spec, trunk.channels())
                                                   : nullptr),
      own_mapper_(own_trunk_ != nullptr
                      ? std::make_unique<SurfaceMapper>(networks, spec, "crop_dense_head", spec.crop_charts_file,
                                                        trunk.channels(), mapper.chart_channels())
                      : nullptr),
      trunk_(own_trunk_ != nullptr ? *own_trunk_ : trunk),
      mapper_(own_mapper_ != nullptr ? *own_mapper_ : mapper) {
  if (mapper_.chart_channels() != mapper.chart_channels()) {
    const Bundle& bundle = networks.bundle();
    throw Error(MAQ_ERROR_BAD_BUNDLE, bundle.path_of(spec_.crop_charts_file), " is for ", mapper_.chart_channels(),
                " channels, but ", spec_.charts_file, " for ", mapper.chart_channels(), ". Export the bundle again.");
  }
}

float CropPass::min_box_score(float threshold) const {
  if (settings_.crops == PersonCrops::kOff) return threshold;
  return std::min(threshold, probability(odds(threshold) / kMaxGainedOdds));
}

float CropPass::score_of(const MappedPerson& person) const {
  return probability(odds(person.found.score) * odds(person.confidence) / odds(kNeutralConfidence));
}

void CropPass::choose(std::vector<MappedPerson>& people, const Point& up, const std::vector<MappedPerson>* previous) {
  const float threshold = spec_.dense_head.mask_threshold;
  for (MappedPerson& person : people) {
    const DenseLogits logits = person.logits();
    classify_cells(logits, memory_);
    person.confidence = part_confidence(logits, threshold, memory_);
    const AffineMap cells = person.first_view ? person.first_view->to_cells(logits.size).inverse()
                                              : map_of_cells(person.region, logits.size);
    person.body = person_bounds(logits.size, cells, threshold, memory_);
    const MappedPerson* const before = previous != nullptr ? find_same(*previous, person.body) : nullptr;
    person.had_crop = before != nullptr && before->crop;
    const auto axis = find_body_axis(logits, cells, threshold, memory_);
    const bool is_small = std::max(person.found.box.width(), person.found.box.height()) <
                          (person.had_crop ? kSmallKeptPx : kSmallPersonPx);
    const bool is_leaning = leans(axis, person.had_crop ? kMinLeanKeptDegrees : kMinLeanDegrees, up);
    if (settings_.crops != PersonCrops::kAll && !is_small && !is_leaning) continue;
    const Point crop_up = person.had_crop ? steady_axis(axis.value_or(up), *before->crop) : axis.value_or(up);
    person.crop =
        crop_around_person(logits.size, cells, crop_up, threshold, previous != nullptr ? kMotionMargin : kCropMargin,
                           settings_.crop_side_px, memory_);
    if (person.had_crop)
      person.crop = steady_crop(*person.crop, *before->crop, kSteadyShiftOfFirst * settings_.crop_side_px);
  }
}

int CropPass::run(const ImageView& image, std::vector<MappedPerson>& people, RunCancel& cancel,
                  maq_provider* provider) {
  const auto has_crop = [](const MappedPerson& person) { return person.crop.has_value(); };
  const size_t count = size_t(std::count_if(people.begin(), people.end(), has_crop));
  if (count == 0) return 0;
  // The dense head may be the one that gave the first answers, and needs its memory again.
  const size_t labels_size = mapper_.labels_size(), surface_size = mapper_.surface_size();
  first_answers_.resize(people.size() * (labels_size + surface_size));
  float* copy = first_answers_.data();
  mapper_.begin();
  const int side = settings_.crop_side_px;
  for (MappedPerson& person : people) {
    if (person.answer.labels != nullptr) {
      float* const surface = std::copy_n(person.answer.labels, labels_size, copy);
      float* const end = std::copy_n(person.answer.surface, surface_size, surface);
      person.answer = {copy, surface};
      copy = end;
    }
    if (!person.crop) continue;
    make_crop_input(image, person.crop->to_image, {side, side}, spec_.input, input_);
    *provider = trunk_.run(input_.values, side, side, cancel);
    mapper_.add(trunk_.features()[0], person.crop->box);
  }
  mapper_.run(cancel);
  size_t index = 0;
  for (MappedPerson& person : people) {
    if (!person.crop) continue;
    const SurfaceAnswer answer = mapper_.answer(index++);
    if (person.answer.labels != nullptr) {
      const DenseLogits logits = mapper_.logits_of(answer);
      classify_cells(logits, memory_);
      const float confidence = part_confidence(logits, spec_.dense_head.mask_threshold, memory_);
      if (confidence < person.confidence - (person.had_crop ? kMaxLostByKept : kMaxLostConfidence)) {
        person.crop.reset();
        continue;
      }
      person.confidence = confidence;
    }
    person.answer = answer;
    person.mapper = &mapper_;
  }
  return int(count);
}

void CropPass::follow(MappedPerson& person, bool has_new_box, int width_px, int height_px,
                      const DecodeMemory& painted) const {
  const float threshold = spec_.dense_head.mask_threshold;
  const DenseLogits logits = person.logits();
  const AffineMap cells = person.crop->to_cells(logits.size).inverse();
  Box bounds = person_bounds(logits.size, cells, threshold, painted);
  person.body = bounds;
  if (has_new_box) {
    person.beyond_body = {person.box.x0 - bounds.x0, person.box.y0 - bounds.y0, person.box.x1 - bounds.x1,
                          person.box.y1 - bounds.y1};
  } else {  // the box head has not seen the person in this frame
    bounds = {bounds.x0 + person.beyond_body.x0, bounds.y0 + person.beyond_body.y0, bounds.x1 + person.beyond_body.x1,
              bounds.y1 + person.beyond_body.y1};
    if (clip_box(bounds, float(width_px), float(height_px))) person.box = bounds;
  }
  // Where the surface has no end inside the crop, as between people who touch, the crop would grow in each frame.
  if (has_new_box) person.open_sides = open_sides(logits.size, threshold, painted);
  const PersonCrop before = *person.crop;
  const PersonCrop wanted = crop_around_person(logits.size, cells, before.up(), threshold, kMotionMargin,
                                               settings_.crop_side_px, painted, person.open_sides);
  person.crop = steady_crop(wanted, before, kSteadyShift * settings_.crop_side_px);
}

}  // namespace maq
