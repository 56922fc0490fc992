// A capture, read from disk and checked: photos with their cameras, and a point cloud.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/frame.h"
#include "image/geometry/lens.h"
#include "image/geometry/pinhole_camera.h"
#include "scene/capture/import_report.h"
#include "scene/point_cloud.h"

namespace maq {

struct CaptureView {
  std::string name;         // as the capture names the photo
  std::string image_path;   // on this machine
  Lens lens;                // of the photo as it lies there, with its distortion
  PinholeCamera camera;     // of the photo after undistortion
  bool is_held_out;         // kept to compare with: no scene is made of it
  std::string depth_path;   // of the depth image of the same view; "" without one
  double depth_unit_m = 0;  // like PosedPhoto::depth_unit_m
};

struct Capture {
  std::vector<CaptureView> views;  // one at least
  PointCloud cloud;                // its origin is amid the cameras; without a point only where a view has depth
  bool is_sparse = false;          // the cloud: points by which cameras were found, too few to build a scene of
  std::array<double, 3> up = {0, 0, 1};
  std::vector<Dropped> dropped;
};

// Opens what is in a folder: a COLMAP model in sparse/0, sparse, colmap/sparse/0 or the folder itself, with the photos
// in images, photos, rgb, input or the folder itself, and the dense fused.ply in place of the model's points where
// there is one (otherwise the cloud is sparse); or transforms.json (or transforms_train.json) with the PLY cloud that
// it names, or sparse_pc.ply, points3d.ply, points3D.ply, pointcloud.ply or cloud.ply. The first of these that is there
// is taken.
//
// A photo of another size than its camera is used if both have the same aspect ratio within 1 %. Photos are read as
// they are stored, not rotated by EXIF, as by the programs that find the cameras. Unusable parts are dropped and
// counted. Up is the cameras' for COLMAP (scene_up.h); +z for transforms.json, unless the cameras say otherwise by over
// 45 degrees.
//
// Throws MAQ_ERROR_NOT_FOUND when there is no such folder, no capture in it or neither a cloud nor a depth image,
// MAQ_ERROR_UNREADABLE for damaged files and when no photo or no point is left, MAQ_ERROR_UNSUPPORTED for camera
// models, versions and numbers of points that are not read.
Capture open_capture(const std::string& folder);

// Reads a view's photo and undistorts it: `picture` is BGR of the size of view.camera; `valid` has 255 for pixels that
// the photo has, 0 for others. Throws the errors of read_image_file(), MAQ_ERROR_UNREADABLE also if the photo's size
// changed since the capture was opened.
void load_view(const CaptureView& view, Frame& picture, std::vector<uint8_t>& valid);

// Reads a view's depth image: DEPTH16 or DEPTH32F of any size, and `camera`, its camera. Throws the errors of
// read_depth_file(), MAQ_ERROR_NOT_FOUND for a view without depth, MAQ_ERROR_UNSUPPORTED for a lens with distortion.
void load_depth(const CaptureView& view, Frame& depth, PinholeCamera& camera);

}  // namespace maq
