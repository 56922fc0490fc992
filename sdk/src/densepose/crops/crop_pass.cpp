#include "densepose/crops/crop_pass.h"

#include <algorithm>

#include "core/error.h"

namespace maq {
namespace {

// People gain by a crop whose box has a shorter long side, in pixels of the network's input, or who lean by more.
constexpr float kSmallPersonPx = 150;
constexpr double kMinLeanDegrees = 15;
// The first answer may cut people off: the region of a crop is wider on each side by this fraction of its long side.
constexpr double kCropMargin = 0.03;
// Crops follow people who move by less than this fraction of their long side from frame to frame.
constexpr double kMotionMargin = 0.05;
// The answer of a crop may be less confident than the first one by this mean probability of the part. Measured on
// renderings and photographs: some people, mostly large ones in groups, lose less by crops with this limit.
constexpr float kMaxLostConfidence = 0.1f;
// With crops a person's score includes the confidence of the parts: the odds of the box head are multiplied by the odds
// of the mean probability, over the odds of kNeutralConfidence. So boxes count whose own odds are below the threshold
// by a factor of kMaxGainedOdds. Chosen on renderings and photographs of the validation split.
constexpr float kNeutralConfidence = 0.4f, kMaxGainedOdds = 3.5f;

float odds(float probability) {
  const float inside = std::clamp(probability, 1e-4f, 1 - 1e-4f);
  return inside / (1 - inside);
}
float probability(float odds) { return odds / (1 + odds); }

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

void CropPass::choose(std::vector<MappedPerson>& people, const Point& up) {
  const float threshold = spec_.dense_head.mask_threshold;
  for (MappedPerson& person : people) {
    const DenseLogits logits = person.logits();
    classify_cells(logits, memory_);
    person.confidence = part_confidence(logits, threshold, memory_);
    const AffineMap cells = person.first_view ? person.first_view->to_cells(logits.size).inverse()
                                              : map_of_cells(person.region, logits.size);
    const auto axis = find_body_axis(logits, cells, threshold, memory_);
    const PersonCrop crop = crop_around_person(logits.size, cells, axis.value_or(up), threshold, kCropMargin,
                                               settings_.crop_side_px, memory_);
    const bool is_small = std::max(person.found.box.width(), person.found.box.height()) < kSmallPersonPx;
    if (settings_.crops == PersonCrops::kAll || leans(axis, kMinLeanDegrees, up) || is_small) person.crop = crop;
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
      if (confidence < person.confidence - kMaxLostConfidence) {
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

void CropPass::follow(MappedPerson& person, bool is_key_frame, int width_px, int height_px, const Point& up,
                      const DecodeMemory& painted) const {
  const float threshold = spec_.dense_head.mask_threshold;
  const DenseLogits logits = person.logits();
  const AffineMap cells = person.crop->to_cells(logits.size).inverse();
  Box bounds = person_bounds(logits.size, cells, threshold, painted);
  if (is_key_frame) {
    person.beyond_body = {person.box.x0 - bounds.x0, person.box.y0 - bounds.y0, person.box.x1 - bounds.x1,
                          person.box.y1 - bounds.y1};
  } else {  // the box head has not seen the person in this frame
    bounds = {bounds.x0 + person.beyond_body.x0, bounds.y0 + person.beyond_body.y0, bounds.x1 + person.beyond_body.x1,
              bounds.y1 + person.beyond_body.y1};
    if (clip_box(bounds, float(width_px), float(height_px))) person.box = bounds;
  }
  const auto axis = find_body_axis(logits, cells, threshold, painted);
  person.crop = crop_around_person(logits.size, cells, axis.value_or(up), threshold, kMotionMargin,
                                   settings_.crop_side_px, painted);
}

}  // namespace maq
