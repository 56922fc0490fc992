// Observations of one person in an image: pixels, and the points of the body that are seen there.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "body/model/body_model.h"
#include "body/pose/body_camera.h"

namespace maq::body {

// A dense pose image: one byte a pixel in each plane. `person` may be null: every pixel with a part is of person 1.
struct LabelImage {
  int width_px = 0, height_px = 0;
  const uint8_t* part = nullptr;  // 1 to 24, 0 for background; larger values are left out
  const uint8_t* u = nullptr;     // U * 255
  const uint8_t* v = nullptr;
  const uint8_t* person = nullptr;  // number of the person from 1, 0 for background
  size_t stride_bytes = 0;
};

// The pixels of one person; right and bottom are exclusive.
struct PersonPixels {
  int64_t count = 0;
  int left = 0, top = 0, right = 0, bottom = 0;
};

// The pixels of each person, by the number in the person plane.
using PeoplePixels = std::array<PersonPixels, 256>;
PeoplePixels find_people(const LabelImage& image);

inline constexpr size_t kPointJoints = 8;

// A point of the body, with all joints that move it.
struct SeenPoint {
  Vec3 rest;
  ShapeVectors basis;
  size_t joint_count = 0;
  std::array<uint8_t, kPointJoints> joints{};
  std::array<double, kPointJoints> weights{};  // sum 1
};

struct Observation {
  SeenPoint point;
  Pixel at;
  double weight = 1;  // 1 for the error of size_px * kErrorOfSize
  uint8_t part = 0;   // 0 for a keypoint
};

struct Observations {
  std::vector<Observation> points;
  double size_px = 0;        // square root of the person's area: some 0.7 m of an adult who is seen whole
  size_t surface_count = 0;  // of the points; keypoints follow
};

// The point of the surface with a label: bilinear between the nodes around it that the chart reaches. False where it
// reaches none of them.
bool surface_point(const BodyModel& model, int part, double u, double v, SeenPoint& point);

// Overwrites `found` and reuses its memory: some `target` pixels of the person on an even grid.
void sample_person(const BodyModel& model, const LabelImage& image, uint8_t number, const PersonPixels& pixels,
                   int target, Observations& found);

// Adds keypoints [33][3]: x, y (pixel k covers k to k + 1) and confidence. Values that are not finite, and confidences
// below `min_confidence`, are left out.
void add_keypoints(const BodyModel& model, const float* keypoints, double min_confidence, Observations& found);

}  // namespace maq::body
