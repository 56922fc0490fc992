// Parts of a depth frame that the edge network runs on.
#pragma once

namespace maq {

// It may reach beyond the frame's right and lower border by less than what it has of the frame. No width: none.
struct FieldWindow {
  int left_px = 0, top_px = 0, width_px = 0, height_px = 0;
};

// Whether they have pixels in common.
inline bool overlap(const FieldWindow& a, const FieldWindow& b) {
  return a.left_px < b.left_px + b.width_px && b.left_px < a.left_px + a.width_px &&
         a.top_px < b.top_px + b.height_px && b.top_px < a.top_px + a.height_px;
}

// What the network must find anew, from the frame's corner; `right_px` 0: nothing.
struct FieldBounds {
  int left_px, top_px, right_px = 0, bottom_px = 0;

  // Nothing yet, in a frame of this size.
  FieldBounds(int width_px, int height_px) : left_px(width_px), top_px(height_px) {}
  void add(int left, int top, int right, int bottom);
};

// The part of a frame that holds `bounds` with eps_r around it and some context. Its sides are half of the frame's or
// all of it, multiples of `multiple_px`: each size takes a session of its own.
FieldWindow window_around(const FieldBounds& bounds, int width_px, int height_px, int multiple_px);

}  // namespace maq
