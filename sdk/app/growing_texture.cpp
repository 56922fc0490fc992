#include "app/growing_texture.h"

#include <utility>
#include <vector>

namespace maquette {
namespace {

constexpr int kMaxFramesAway = 90;
constexpr int kFramesOfDrawing = 8;  // drawing takes longer than adding

std::optional<uint32_t> index_of(const std::vector<maq_densepose_person>& people, int64_t id) {
  for (uint32_t i = 0; i < people.size(); ++i)
    if (people[i].id == id) return i;
  return std::nullopt;
}

uint32_t largest_of(const std::vector<maq_densepose_person>& people) {
  const auto area = [](const float* box) { return (box[2] - box[0]) * (box[3] - box[1]); };
  uint32_t largest = 0;
  for (uint32_t i = 1; i < people.size(); ++i)
    if (area(people[i].box_px) > area(people[largest].box_px)) largest = i;
  return largest;
}

}  // namespace

void GrowingTexture::add(const DensePoseResult& result, const Frame& frame) {
  const std::vector<maq_densepose_person> people = result.people();
  std::optional<uint32_t> index;
  if (texture_) index = index_of(people, person_);
  if (!index && texture_ && ++frames_away_ <= kMaxFramesAway) return;
  if (!index) {
    if (people.empty()) return;
    index = largest_of(people);
    person_ = people[*index].id;
    texture_.emplace(context_);
    frames_since_drawn_ = kFramesOfDrawing;
  }
  frames_away_ = 0;
  texture_->add_person(result, *index, frame);
  if (++frames_since_drawn_ < kFramesOfDrawing) return;
  frames_since_drawn_ = 0;
  auto drawn = std::make_shared<RgbaImage>();
  const std::array<int32_t, 2> size = texture_->size_px();
  drawn->resize(size[0], size[1]);
  drawn->rgba = texture_->draw();
  image_ = std::move(drawn);
}

}  // namespace maquette
