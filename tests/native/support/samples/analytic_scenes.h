// The scenes that curves are judged on, about a metre large, as their camera sees them.
#pragma once

#include "support/samples/analytic_solids.h"

namespace maq::test {

inline int add_floor(SolidScene& scene, double size = 8) {
  return scene.add_polygon({{-size, -size, 0}, {size, -size, 0}, {size, size, 0}, {-size, size, 0}}, {0, 0, 1});
}

inline SolidScene lone_box() {
  SolidScene scene;
  scene.add_box({0, 0, 0}, {0.5, 0.36, 0.3}, 0.6, -1);
  scene.seen_from({0.1, -1.1, 0.75}, {0, 0, 0.14});
  return scene;
}

// A carton on a table (a larger box) in the corner of a room.
inline SolidScene room() {
  SolidScene scene;
  const double far = 1.6, wide = 6, high = 4;
  const int floor = scene.add_polygon({{-wide, -wide, 0}, {far, -wide, 0}, {far, far, 0}, {-wide, far, 0}}, {0, 0, 1});
  const int back =
      scene.add_polygon({{-wide, far, 0}, {far, far, 0}, {far, far, high}, {-wide, far, high}}, {0, -1, 0});
  const int right =
      scene.add_polygon({{far, -wide, 0}, {far, far, 0}, {far, far, high}, {far, -wide, high}}, {-1, 0, 0});
  scene.add_line({-wide, far, 0}, {far, far, 0}, floor, back);
  scene.add_line({far, -wide, 0}, {far, far, 0}, floor, right);
  scene.add_line({far, far, 0}, {far, far, high}, back, right);
  const int table = scene.add_box({0.1, 0.2, 0}, {1.3, 0.8, 0.55}, 0.15, floor);
  scene.add_box({0.15, 0.15, 0.55}, {0.4, 0.3, 0.25}, 0.7, table);
  scene.seen_from({-1.1, -2.0, 1.7}, {0.3, 0.35, 0.5});
  return scene;
}

inline SolidScene standing_cylinder() {
  SolidScene scene;
  const int floor = add_floor(scene);
  scene.add_cylinder({0, 0, 0}, 0.25, 0.4, floor);
  scene.seen_from({0, -1.1, 0.9}, {0, 0, 0.15});
  return scene;
}

inline SolidScene stacked_boxes() {
  SolidScene scene;
  const int floor = add_floor(scene);
  const int top = scene.add_box({0, 0, 0}, {0.6, 0.5, 0.3}, 0.4, floor);
  scene.add_box({0.03, 0.02, 0.3}, {0.35, 0.3, 0.25}, 0.9, top);
  scene.seen_from({-0.2, -1.3, 1.0}, {0, 0, 0.22});
  return scene;
}

inline SolidScene rounded_box() {
  SolidScene scene;
  const int floor = add_floor(scene);
  scene.add_rounded_box({0, 0, 0}, {0.6, 0.4, 0.35}, 0.1, floor);
  scene.seen_from({-0.7, -1.0, 0.8}, {0, 0, 0.15});
  return scene;
}

// Two planes that meet in an edge up the middle, by so much less than flat; seen from the front.
inline SolidScene ridge(double bend_rad) {
  SolidScene scene;
  const double c = 3 * std::cos(bend_rad / 2), s = 3 * std::sin(bend_rad / 2);
  const Vec3 low{0, 0, -2}, high{0, 0, 2}, left{-c, s, 0}, right{c, s, 0};
  const int a = scene.add_polygon({low, high, high + left, low + left}, {-s, -c, 0});
  const int b = scene.add_polygon({low, high, high + right, low + right}, {s, -c, 0});
  scene.add_line(low, high, a, b);
  scene.seen_from({0.05, -1.2, 0.03}, {0.02, 0, 0});
  return scene;
}

}  // namespace maq::test
