// A second pass over people, each in a crop of the image at full resolution; and tracking of people in crops.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/frame.h"
#include "densepose/bundle/settings.h"
#include "densepose/crops/person_crop.h"
#include "densepose/detector/box.h"
#include "densepose/detector/trunk.h"
#include "densepose/surface/surface_mapper.h"
#include "image/crop_input.h"

namespace maq {

// A person with the answer of a dense head.
struct MappedPerson {
  ScoredBox found;                       // in pixels of the network's input
  float to_seen = 1;                     // pixels of the frame's last input in a pixel of the person's input
  Box box;                               // in pixels of the image
  Box region;                            // in pixels of the image: seen by the dense head, wider than `box`
  Box input_region;                      // the same in pixels of the network's input
  int input_side_px = 0;                 // long side of this input
  Box body;                              // in pixels of the image: bounds of the surface
  Box beyond_body;                       // from the bounds of the painted body to `box`, of the latest key frame
  std::optional<PersonCrop> first_view;  // the region of the first answer, in an image that was rotated
  std::optional<PersonCrop> crop;
  bool had_crop = false;            // in the previous frame of the stream
  OpenSides open_sides;             // of the crop of the latest key frame
  float confidence = 0;             // of the answer in use
  int64_t body_pixels = 0;          // when last painted
  SurfaceAnswer answer;             // of the crop if there is one
  SurfaceMapper* mapper = nullptr;  // gave the answer

  DenseLogits logits() const { return mapper->logits_of(answer); }
};

class CropPass {
 public:
  // Opens crop networks if the bundle has them and the settings have crops; otherwise crops go through `trunk` and
  // `mapper`. The arguments but `networks` must outlive this. The settings are resolved.
  CropPass(const DensePoseNetworks& networks, const DensePoseSpec& spec, const DensePoseSettings& settings,
           Trunk& trunk, SurfaceMapper& mapper);

  // Returns the score of a person from the box head that may reach `threshold` with the confidence of its parts.
  float min_box_score(float threshold) const;
  // Returns the score with the confidence of the answer.
  float score_of(const MappedPerson& person) const;

  // Gives crops to the people who gain by one. `up`: in the image, a unit vector. `previous`: in a stream, the
  // people of the previous frame, whose crops stay the same as far as possible; nullptr for a still image.
  void choose(std::vector<MappedPerson>& people, const Point& up, const std::vector<MappedPerson>* previous);
  // Runs trunk and dense head over the crops of `people`. A new answer replaces the first one unless it is clearly less
  // confident; then the person loses the crop. Returns the number of crops; `*provider` is set if there are any.
  int run(const ImageView& image, std::vector<MappedPerson>& people, RunCancel& cancel, maq_provider* provider);
  // Gives a person who was just painted the crop for the next frame, rotated as before, and without `has_new_box` (of
  // the box head) a new box. `painted` holds
  // the classified cells of the answer; the sizes are the image's.
  void follow(MappedPerson& person, bool has_new_box, int width_px, int height_px, const DecodeMemory& painted) const;

 private:
  const DensePoseSpec& spec_;
  const DensePoseSettings& settings_;
  std::unique_ptr<Trunk> own_trunk_;
  std::unique_ptr<SurfaceMapper> own_mapper_;
  Trunk& trunk_;
  SurfaceMapper& mapper_;
  // Scratch of a frame.
  CropInput input_;
  DecodeMemory memory_;
  std::vector<float> first_answers_;  // while the dense head runs again
};

}  // namespace maq
