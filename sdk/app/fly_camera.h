// The camera with which a user flies through a scene (maquette/scene.h). Calls with a number that is not finite, or
// with an invalid camera, do nothing.
#pragma once

#include <array>
#include <maquette/maquette.hpp>
#include <optional>
#include <vector>

namespace maquette {

class FlyCamera {
 public:
  // Starts at the middle photo; without photos outside of the scene's bounding box, facing it.
  FlyCamera(const maq_scene_info& scene, const std::vector<maq_pinhole_camera>& photos);
  // Each -1 to 1: to the camera's right, along the world's up, forwards. `speed`: diagonals of the bounding box a
  // second.
  void move(double right, double up, double forward, double seconds, double speed);
  // To the right about the world's up, and upwards, in radians; stops short of straight up and down. A camera that is
  // rolled becomes level gradually.
  void rotate(double yaw, double pitch);
  void zoom(double factor);  // above 1 the scene gets larger; the longer side keeps within 20 to 110 degrees
  // Flies there while update() is called, until the user steers; is there at once for 0 seconds.
  void fly_to(const maq_pinhole_camera& camera, double seconds, int photo_index);
  bool update(double seconds);                                   // true when it moved
  maq_pinhole_camera camera(int width_px, int height_px) const;  // shows all that the photo it was at last would
  // The photo's camera at which it started or to which it flew, until it leaves. It has the photo's size, for a
  // comparison pixel by pixel.
  const std::optional<maq_pinhole_camera>& photo_camera() const { return at_; }
  int photo_index() const { return at_ ? photo_index_ : -1; }
  int nearest_photo(
      const std::vector<maq_pinhole_camera>& photos) const;  // by position and direction; -1 without photos

 private:
  using Vec3 = std::array<double, 3>;
  struct Pose {
    std::array<Vec3, 3> rows;  // world to camera: to the right, down, forward
    Vec3 centre;
    std::array<double, 6> lens;  // pixels: width, height, fx, fy, offset of the principal point from the middle in x, y
  };

  static std::optional<Pose> pose_of(const maq_pinhole_camera& camera);
  void leave() { at_.reset(), target_.reset(); }

  Vec3 up_;          // the world's
  double size_ = 1;  // the bounding box's diagonal
  Pose pose_, from_, to_;
  std::optional<maq_pinhole_camera> at_, target_;  // target: while it flies
  int photo_index_ = -1;
  double flight_s_ = 0, flown_s_ = 0;
};

}  // namespace maquette
