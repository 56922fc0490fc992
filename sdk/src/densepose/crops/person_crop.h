// Crops of people: one person cut out of the image, rotated upright, at one size. Trunk and dense head go over them a
// second time for people who are small in the network's input or lean, of whom the first time gives a rough surface.
#pragma once

#include <optional>
#include <vector>

#include "densepose/surface/dense_decode.h"
#include "image/crop_input.h"

namespace maq {

constexpr double kMinRotationDegrees = 10;  // people who lean less are not rotated

// A square of the image with the person in its middle.
struct PersonCrop {
  AffineMap to_image;  // from the crop's pixels
  AffineMap to_crop;   // from the image's pixels
  Box box;             // around the person, in pixels of the crop
  bool is_rotated = false;

  // From the image's pixels to `cells` x `cells` cells of `box`.
  AffineMap to_cells(int cells) const;
  // The direction in the image that is up in the crop, a unit vector.
  Point up() const;
};

// The sides of the cells at which the person is seen up to the last cell.
struct OpenSides {
  bool left = false, top = false, right = false, bottom = false;
};
OpenSides open_sides(int size, float mask_threshold, const DecodeMemory& memory);

// From `cells` x `cells` cells that cover `box` to the image that the box is of.
AffineMap map_of_cells(const Box& box, int cells);

// The person's axis, from hips to head, as a unit vector in the image (y points down): the sum of the directions
// against the slope of U on the torso, which falls towards the neck, and from the torso's middle to the head's. None
// where too little of the torso is seen: a head with shoulders shows no direction. `memory` holds the classified cells
// of `logits`, which must have charts.
std::optional<Point> find_body_axis(const DenseLogits& logits, const AffineMap& cells_to_image, float mask_threshold,
                                    const DecodeMemory& memory);

// Whether the axis leans from `up`, a unit vector, by more than that.
bool leans(const std::optional<Point>& axis, double degrees, const Point& up = {0, -1});

// The crop of `side_px` pixels around the cells that show the person, around all where none does; rotated upright if
// `axis` leans by more than kMinRotationDegrees. Its box is `margin` of its long side larger each way, but not at the
// sides `without_margin`. `size`: of the logits whose cells `memory` holds.
PersonCrop crop_around_person(int size, const AffineMap& cells_to_image, const std::optional<Point>& axis,
                              float mask_threshold, double margin, int side_px, const DecodeMemory& memory,
                              const OpenSides& without_margin = {});

// The axis for the next crop of a person in a stream: that of the crop before, unless the person turned by more than a
// few degrees. So small errors of the axis do not turn the crop from frame to frame.
Point steady_axis(const std::optional<Point>& axis, const PersonCrop& before);

// The crop for the next frame of a stream: `before` while the corners of the person's box move by less than
// `max_shift_px` in it, else `wanted`. A person who stands still is seen through the same pixels in each frame, and so
// gets the same labels.
PersonCrop steady_crop(const PersonCrop& wanted, const PersonCrop& before, double max_shift_px);

// The bounds in the image of the cells that show the person, of all where none does.
Box person_bounds(int size, const AffineMap& cells_to_image, float mask_threshold, const DecodeMemory& memory);

}  // namespace maq
