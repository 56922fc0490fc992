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
};

// From `cells` x `cells` cells that cover `box` to the image that the box is of.
AffineMap map_of_cells(const Box& box, int cells);

// The person's axis, from hips to head, as a unit vector in the image (y points down): the sum of the directions
// against the slope of U on the torso, which falls towards the neck, and from the torso's middle to the head's. None
// where too little of the torso is seen. `memory` holds the classified cells of `logits`, which must have charts.
std::optional<Point> find_body_axis(const DenseLogits& logits, const AffineMap& cells_to_image, float mask_threshold,
                                    const DecodeMemory& memory);

// Whether the axis leans from `up`, a unit vector, by more than that.
bool leans(const std::optional<Point>& axis, double degrees, const Point& up = {0, -1});

// The crop of `side_px` pixels around the cells that show the person, around all where none does; rotated upright if
// `axis` leans by more than kMinRotationDegrees. Its box is `margin` of its long side larger each way. `size`: of the
// logits whose cells `memory` holds.
PersonCrop crop_around_person(int size, const AffineMap& cells_to_image, const std::optional<Point>& axis,
                              float mask_threshold, double margin, int side_px, const DecodeMemory& memory);

// The bounds in the image of the cells that show the person, of all where none does.
Box person_bounds(int size, const AffineMap& cells_to_image, float mask_threshold, const DecodeMemory& memory);

}  // namespace maq
