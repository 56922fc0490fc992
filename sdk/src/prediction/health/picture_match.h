// Finds the parts of one small picture in another: how the picture moved, and which parts no motion explains.
#pragma once

#include <cstddef>
#include <vector>

#include "prediction/flow/luma_pyramid.h"
#include "prediction/flow/patch_search.h"

namespace maq {

// The luma of a frame at some 80 pixels a side, and at half of that.
class SmallPicture {
 public:
  static constexpr int kLongSide_px = 96;  // at most

  // Allocates nothing for a known size.
  void set(const LumaPyramid& frame);

  const LumaLevel& fine() const { return pyramid_.level(0); }
  const LumaLevel& coarse() const { return pyramid_.level(pyramid_.level_count() > 1 ? 1 : 0); }
  // Pixels of the frame's finest level to one pixel of fine().
  int scale() const { return scale_; }

 private:
  LumaPyramid pyramid_;
  std::vector<float> luma_;
  int scale_ = 1;
};

// How the parts of a picture follow from another picture. Parts are patches that overlap by half.
class PictureMatch {
 public:
  // Searches each patch of `picture` in `other`, a picture of the same size, within a quarter of its width. Allocates
  // nothing for a known size.
  void find(const SmallPicture& picture, const SmallPicture& other);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  // For each patch: 0 where motion explains it, 1 where nothing in the other picture is like it. [rows][columns]
  const std::vector<float>& unexplained() const { return unexplained_; }
  // The fraction of patches that motion does not explain.
  float unexplained_fraction() const { return unexplained_fraction_; }
  // The fraction of patches without detail.
  float flat_fraction() const { return flat_fraction_; }
  // How the middle of the picture moved, from the other picture to this one, in fractions of its width; and the
  // fraction of patches with detail that move so, together, as a camera that moves, rolls or zooms makes them.
  float shift_x() const { return shift_x_; }
  float shift_y() const { return shift_y_; }
  float shift_fraction() const { return shift_fraction_; }
  // The fraction of patches with detail that motion explains.
  float explained_detail_fraction() const { return explained_detail_fraction_; }
  // Whether a patch stays where it is, or moves with the picture.
  bool is_at_rest(size_t patch) const;

 private:
  void search_coarsely(const LumaLevel& from, const LumaLevel& to);
  void compare_brightness(const LumaLevel& from, const LumaLevel& to);
  // The displacement of a point at (x, y) from the middle of the picture, in pixels.
  struct CameraMotion {
    float dx = 0, dy = 0, turn = 0, zoom = 0;
    Displacement at(float x, float y) const { return {dx + zoom * x - turn * y, dy + turn * x + zoom * y}; }
  };
  Displacement middle_of(size_t patch) const;
  // Whether the other picture shows it, by the camera's motion.
  bool is_in_view(size_t patch) const;
  void find_camera_motion();
  void leave_out_what_came_into_view();

  int columns_ = 0, rows_ = 0, coarse_columns_ = 0, coarse_rows_ = 0;
  std::vector<Displacement> coarse_;  // of patches of the coarse level
  std::vector<Patch> patches_;
  std::vector<float> brightness_;  // [patches]: mean luma less that of the patch found
  std::vector<float> unexplained_, sorted_;
  float unexplained_fraction_ = 0, flat_fraction_ = 0, shift_x_ = 0, shift_y_ = 0, shift_fraction_ = 0;
  float explained_detail_fraction_ = 0;
  CameraMotion camera_;
  int width_px_ = 0, height_px_ = 0;
};

}  // namespace maq
